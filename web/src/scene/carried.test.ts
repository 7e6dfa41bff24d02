import { Matrix4, Vector3 } from 'three';
import { describe, expect, test } from 'vitest';
import { jointMatrices } from '../robot/chain';
import type { PlanAnswer, PlanRequest, Robot } from '../service/types';
import { handledNames } from '../request/handled';
import { placedAt, stretchesOf } from './carried';
import type { Carrier } from './carried';
import type { Placed } from './objects';

const still = { quaternion_xyzw: [0, 0, 0, 1] };
// Two joints that turn about z, 1 m apart; the tip is another metre away.
const arm = {
  joints: [
    { name: 'a', kind: 'revolute' },
    { name: 'b', kind: 'revolute' },
  ],
  chain: [
    { position: [0, 0, 0], ...still, axis: [0, 0, 1] },
    { position: [1, 0, 0], ...still, axis: [0, 0, 1] },
  ],
  placements: [
    { frame: 'tip', after: 2, position: [1, 0, 0], ...still },
    { frame: 'upper', after: 1, position: [0.5, 0, 0], ...still },
  ],
  tip_frame: 'tip',
} as unknown as Robot;
const thing = (id: string, after: number | null, x: number, y: number): Placed => ({
  id,
  shape: { kind: 'sphere', radius: 0.1 },
  margin: 0,
  matrix: new Matrix4().makeTranslation(x, y, 0),
  after,
  by: 0,
});
const quarter = Math.PI / 2;
const positions = [
  [0, 0],
  [0, quarter],
  [quarter, quarter],
  [0, 0],
];
const answer = { waypoints: positions.map((position, index) => ({ index, position, arrival_time: index })) } as unknown as PlanAnswer;

function request(...waypoints: object[]): PlanRequest {
  return { robot: 'arm', waypoints } as unknown as PlanRequest;
}

function carried(asked: PlanRequest): Carrier[] {
  return [{ request: asked, answer, robot: arm, base: new Matrix4() }];
}

// Where an object is in the base frame at a joint position.
function seen(placed: readonly Placed[], id: string, position: readonly number[]): number[] {
  const { matrix, after } = placed.find((one) => one.id === id)!;
  const at = new Vector3().setFromMatrixPosition(matrix);
  if (after !== null) at.applyMatrix4(jointMatrices(arm, position)[after]!);
  return at.toArray().map((value) => Math.round(value * 1e6) / 1e6 + 0);
}

describe('what is carried', () => {
  test('moves with the tool from where it is taken to where it is put down', () => {
    const asked = request({}, { attach: [{ id: 'part' }] }, { detach: ['part'] }, {});
    const stretches = stretchesOf([thing('part', null, 1, 1), thing('table', null, 3, 0)], carried(asked));
    expect(stretches.map(({ from }) => from)).toEqual([-Infinity, 1, 2]);
    expect(handledNames(asked)).toEqual(['part', 'part']);
    expect(seen(placedAt(stretches, 0.9), 'part', [1, 1])).toEqual([1, 1, 0]);
    const held = placedAt(stretches, 1.5);
    expect(seen(held, 'part', positions[1]!)).toEqual([1, 1, 0]); // it does not jump
    expect(seen(held, 'part', [0, 0])).toEqual([2, 0, 0]);
    expect(seen(placedAt(stretches, 9), 'part', [0, 0])).toEqual([-1, 1, 0]);
    expect(seen(placedAt(stretches, 9), 'table', [1, 1])).toEqual([3, 0, 0]);
  });

  test('is taken where it has stopped, if it moved before', () => {
    const slides: Placed = { ...thing('part', null, 1, -1), at: (time) => new Matrix4().makeTranslation(1, Math.min(2 * time - 1, 1), 0) };
    const stretches = stretchesOf([slides], carried(request({}, { attach: [{ id: 'part' }] }, {}, {})));
    expect(seen(placedAt(stretches, 0.5), 'part', [0, 0])).toEqual([1, 0, 0]);
    expect(seen(placedAt(stretches, 1.5), 'part', positions[1]!)).toEqual([1, 1, 0]);
    expect(seen(placedAt(stretches, 1.5), 'part', [0, 0])).toEqual([2, 0, 0]);
  });

  test('moves along with the object that it is put down on', () => {
    const belt: Placed = { ...thing('tray', null, 0, 0), at: (time) => new Matrix4().makeTranslation(time, 0, 0) };
    const asked = request({ attach: [{ id: 'part' }] }, { on: 'tray', detach: ['part'] }, {}, {});
    const stretches = stretchesOf([belt, thing('part', null, 2, 0)], carried(asked));
    expect(seen(placedAt(stretches, 1), 'part', [0, 0])).toEqual([1, 1, 0]);
    expect(seen(placedAt(stretches, 3.5), 'part', [0, 0])).toEqual([3.5, 1, 0]);
    expect(seen(placedAt(stretches, 0.5), 'part', [0, 0])).toEqual([2, 0, 0]);
  });

  test('may be held by a link, handed over, and attached from the start', () => {
    const asked = request({ attach: [{ id: 'part', link: 'upper' }] }, { detach: ['part', 'cup'], attach: [{ id: 'part' }] }, {}, {});
    const stretches = stretchesOf([thing('part', null, 0.5, 0.2), thing('cup', 2, 1, 0)], carried(asked));
    expect(seen(placedAt(stretches, 0), 'part', [quarter, 2])).toEqual([-0.2, 0.5, 0]);
    expect(placedAt(stretches, 2).map(({ after }) => after)).toEqual([2, null]);
    expect(seen(placedAt(stretches, 2), 'cup', [2, 2])).toEqual([1, 1, 0]);
    expect(seen(placedAt(stretches, 2), 'part', positions[1]!)).toEqual([0.5, 0.2, 0]);
  });

  test('is where the scene has it without a plan', () => {
    const placed = [thing('part', null, 1, 1)];
    expect(placedAt(stretchesOf(placed, []), 5)).toBe(placed);
  });
});

describe('what robots hand over', () => {
  test('moves on with the robot that takes it, when both have arrived', () => {
    const gives = { ...carried(request({ attach: [{ id: 'part' }] }, { detach: ['part'] }, {}, {}))[0]!, meetings: new Map([[1, 1.5]]) };
    const base = new Matrix4().makeTranslation(4, 0, 0).multiply(new Matrix4().makeRotationZ(Math.PI));
    const takes: Carrier = { ...carried(request({}, { attach: [{ id: 'part' }] }, {}, {}))[0]!, base, meetings: new Map([[1, 1.5]]) };
    const stretches = stretchesOf([thing('part', null, 2, 0)], [gives, takes]);
    expect(placedAt(stretches, 1.4).map(({ by, after }) => [by, after])).toEqual([[0, 2]]);
    const [held] = placedAt(stretches, 1.6);
    expect([held!.by, held!.after]).toEqual([1, 2]);
    const place = (joints: readonly Matrix4[]): number[] =>
      new Vector3().setFromMatrixPosition(base.clone().multiply(joints[2]!).multiply(held!.matrix)).toArray();
    place(jointMatrices(arm, positions[1]!)).forEach((value, i) => expect(value).toBeCloseTo([1, 1, 0][i]!)); // it does not jump
  });
});
