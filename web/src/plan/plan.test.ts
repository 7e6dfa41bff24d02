import { describe, expect, test } from 'vitest';
import { jointMatrices, toolMatrix } from '../robot/chain';
import { shapesOf, sticks } from '../robot/shapes';
import type { PlanAnswer, Robot } from '../service/types';
import { axisRange, shareOf } from '../plots/curves';
import { locate, positionAt } from './samples';
import { short } from './units';
import { bandsOf, limitUse } from './use';

const still = { quaternion_xyzw: [0, 0, 0, 1] };
const joint = { lower: -1, upper: 2, velocity: 2, acceleration: 4, jerk: null, torque: null, provenance: {} };
const ranges = { velocity_range: [-1, 3], acceleration_range: null, torque_range: null };

// Two joints in a plane: 1 m to the elbow, which turns; 0.5 m to the tip, which slides along x.
const arm = {
  id: 'arm',
  joint_names: ['a', 'b'],
  joints: [
    { ...joint, ...ranges, name: 'a', kind: 'revolute' },
    { ...joint, ...ranges, velocity_range: null, name: 'b', kind: 'prismatic' },
  ],
  chain: [
    { position: [0, 0, 0.2], ...still, axis: [0, 0, 1] },
    { position: [1, 0, 0], ...still, axis: [1, 0, 0] },
  ],
  placements: [{ frame: 'tip', after: 2, position: [0.5, 0, 0], ...still }],
  tip_frame: 'tip',
  tool: { position: [0, 0, 0.1], ...still },
} as unknown as Robot;

describe('the chain', () => {
  test('places the tool where trigonometry does', () => {
    const [turn, stroke] = [0.7, 0.3];
    const at = toolMatrix(arm, [turn, stroke]).elements;
    const length = 1 + stroke + 0.5;
    [length * Math.cos(turn), length * Math.sin(turn), 0.3].forEach((value, i) => expect(at[12 + i]).toBeCloseTo(value, 12));
    expect(jointMatrices(arm, [turn, stroke])).toHaveLength(3);
  });

  test('becomes sticks where the model has no shapes', () => {
    expect(shapesOf(arm)).toEqual(sticks(arm));
    expect(
      sticks(arm)
        .filter(({ form }) => form.kind === 'capsule')
        .map(({ after }) => after),
    ).toEqual([0, 1, 2]);
  });
});

describe('limits', () => {
  test('are those that the answer states for the segment, or for the sample where they depend on the state', () => {
    const none = { lower: [[null, null]], upper: [[null, null]] };
    const velocity = {
      lower: [
        [-1, -2],
        [-0.5, null],
      ],
      upper: [
        [1, 2],
        [3, null],
      ],
    };
    const samples = { time: [0, 1, 2], segment: [0, 1, 1] };
    const limits = { position: none, velocity, acceleration: none, jerk: none, torque: none, tool: {} };
    const answer = { samples, limits } as unknown as PlanAnswer;
    const narrow = { lower: -0.5, upper: 3 };
    const unlimited = { lower: null, upper: null };
    expect(bandsOf(answer, 'velocity', 0)).toEqual([{ lower: -1, upper: 1 }, narrow, narrow]);
    expect(bandsOf(answer, 'velocity', 1)).toEqual([{ lower: -2, upper: 2 }, unlimited, unlimited]);
    expect(bandsOf({ samples } as unknown as PlanAnswer, 'velocity', 0)).toEqual([unlimited, unlimited, unlimited]);
    const falling = { lower: [[-1], [-1], [-1]], upper: [[3], [2], [1]] };
    const curved = { samples, limits: { ...limits, at_samples: { velocity: falling } } } as unknown as PlanAnswer;
    expect(bandsOf(curved, 'velocity', 0).map(({ upper }) => upper)).toEqual([3, 2, 1]);
    expect(bandsOf(curved, 'position', 0)[0]).toEqual(unlimited);
  });

  test('are used from -100 % to 100 %', () => {
    expect(shareOf(-1, { lower: -1, upper: 2 })).toBe(-100);
    expect(shareOf(2, { lower: -1, upper: 2 })).toBe(100);
    expect(shareOf(1, { lower: -2, upper: 2 })).toBe(50);
    expect(shareOf(1, { lower: null, upper: 2 })).toBeNull();
  });

  test('are on the axis when they are near', () => {
    const curve = { label: '', colour: '', values: [0, 1], bands: [{ lower: -50, upper: 1.5 }] };
    const [low, high] = axisRange([curve]);
    expect(high).toBeGreaterThan(1.5);
    expect(low).toBeGreaterThan(-1);
    expect(axisRange([{ ...curve, values: [null] }])).toEqual([-1, 1]);
  });
});

describe('samples', () => {
  const answer = { samples: { time: [0, 1, 3], position: [[0], [2], [0]] } } as unknown as PlanAnswer;

  test.each([
    [-1, 0],
    [0, 0],
    [0.5, 1],
    [1, 2],
    [2, 1],
    [3, 0],
    [9, 0],
  ])('at %d s', (time, value) => {
    expect(positionAt(answer, time)).toEqual([value]);
  });

  test('of one row are that row', () => {
    expect(locate([0], 0)).toEqual([0, 0]);
  });
});

describe('the use of limits', () => {
  test('is the largest of any joint, of what is promised', () => {
    const answer = {
      certificate: {
        checks: [
          { quantity: 'velocity', enforced: true },
          { quantity: 'acceleration', enforced: false },
        ],
      },
      limits: { velocity: { lower: [[-1, -2]], upper: [[3, 2]] }, acceleration: { lower: [[-4, -4]], upper: [[4, 4]] } },
      samples: {
        time: [0, 1],
        segment: [0, 0],
        velocity: [
          [-0.5, 0.2],
          [1.5, 1],
        ],
        acceleration: [
          [40, 0],
          [0, 0],
        ],
      },
    } as unknown as PlanAnswer;
    expect(limitUse(answer)).toEqual([0.5, 0.5]);
  });
});

test.each([
  [0, '0'],
  [0.25, '0.25'],
  [-1234.567, '-1235'],
  [5.729578e-5, '5.73×10⁻⁵'],
  [-3.17e-9, '-3.17×10⁻⁹'],
  [2e12, '2×10¹²'],
])('%d is written %s', (value, written) => {
  expect(short(value, Math.abs(value) < 1 ? 3 : 4)).toBe(written);
});
