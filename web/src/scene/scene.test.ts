import { Matrix4, Vector3 } from 'three';
import { describe, expect, test } from 'vitest';
import type { LinkShape, Robot, SceneObject, SceneShape } from '../service/types';
import { nearestOf, supportOf } from './nearest';
import { mountingOf, placedOf } from './objects';
import { pointsOf } from './pair';

const still = { quaternion_xyzw: [0, 0, 0, 1] };
// One joint that turns about z; the tip is 1 m away.
const arm = {
  joints: [{ name: 'a', kind: 'revolute' }],
  chain: [{ position: [0, 0, 0], ...still, axis: [0, 0, 1] }],
  placements: [
    { frame: 'tip', after: 1, position: [1, 0, 0], ...still },
    { frame: 'upper', after: 1, position: [0.2, 0, 0], ...still },
  ],
  tip_frame: 'tip',
  tool: { position: [0, 0, 0.1], ...still },
  mounting: null,
} as unknown as Robot;
const ball: SceneShape = { kind: 'sphere', radius: 0.1 };
const at = (x: number, y: number, z: number): Matrix4 => new Matrix4().makeTranslation(x, y, z);
const originOf = ({ matrix }: { matrix: Matrix4 }): number[] => new Vector3().setFromMatrixPosition(matrix).toArray();
const close = (found: readonly number[], expected: readonly number[]): void =>
  found.forEach((value, axis) => expect(value).toBeCloseTo(expected[axis]!, 2));

function gap(first: SceneShape, second: SceneShape, matrix: Matrix4): number {
  const [from, to] = nearestOf(supportOf(first, new Matrix4())!, supportOf(second, matrix)!);
  return from.distanceTo(to);
}

describe('moving objects', () => {
  const quarter = { kind: 'quaternion' as const, xyzw: [0, 0, Math.SQRT1_2, Math.SQRT1_2] };
  const matrixAt = (motion: SceneObject['motion'], time: number): Matrix4 => {
    const scene = { objects: [{ id: 'part', shape: ball, pose: { position: [1, 0, 0] }, frame: 'belt', motion }] };
    const [placed] = placedOf({ scene, frames: { belt: { position: [0, 0, 5], orientation: quarter } } }, arm);
    return placed!.at!(time);
  };

  test.each([
    [0, [0, 1, 5]],
    [0.5, [-1, 1, 5]],
    [9, [-2, 1, 5]],
  ])('slide in their frame until they stop: %s s', (time, expected) => {
    close(originOf({ matrix: matrixAt({ kind: 'linear', velocity: [0, 2, 0], end: 1 }, time) }), expected);
  });

  test.each([
    [1, [0, 1, 5], 0],
    [2, [-1, 2, 5], 45],
    [9, [-2, 3, 5], 90],
  ])('go from pose to pose by the shortest turns: %s s', (time, expected, degrees) => {
    const poses = [
      { time: 1, pose: { position: [1, 0, 0] } },
      { time: 3, pose: { position: [3, 2, 0], orientation: quarter } },
    ];
    const matrix = matrixAt({ kind: 'timed_poses', poses }, time);
    close(originOf({ matrix }), expected);
    const x = new Vector3().setFromMatrixColumn(matrix, 0);
    close([(Math.atan2(x.y, x.x) * 180) / Math.PI], [degrees + 90]); // the frame turns by 90 degrees
  });
});

describe('nearest points', () => {
  test.each<[string, SceneShape, SceneShape, Matrix4, number]>([
    ['balls', ball, { kind: 'sphere', radius: 0.2 }, at(1, 2, 2), 3 - 0.3],
    ['boxes by their faces', { kind: 'box', size: [1, 1, 1] }, { kind: 'box', size: [1, 2, 1] }, at(1.3, 0.2, 0), 0.3],
    ['boxes by their corners', { kind: 'box', size: [1, 1, 1] }, { kind: 'box', size: [1, 1, 1] }, at(2, 2, 2), Math.sqrt(3)],
    ['a ball above a cylinder', { kind: 'cylinder', radius: 0.3, length: 1 }, ball, at(0.1, 0.1, 0.8), 0.2],
    ['a ball beside a cylinder', { kind: 'cylinder', radius: 0.3, length: 1 }, ball, at(0.6, 0.8, 0.2), 0.6],
    ['a capsule and a box', { kind: 'capsule', radius: 0.2, length: 1 }, { kind: 'box', size: [1, 1, 1] }, at(0, 0, 1.5), 0.3],
    [
      'a tetrahedron and a ball',
      {
        kind: 'convex',
        vertices: [
          [0, 0, 0],
          [1, 0, 0],
          [0, 1, 0],
          [0, 0, 1],
        ],
      },
      ball,
      at(1, 1, 1),
      2 / Math.sqrt(3) - 0.1,
    ],
  ])('of %s', (_, first, second, matrix, expected) => {
    expect(gap(first, second, matrix)).toBeCloseTo(expected, 2);
    const back = matrix.clone().invert();
    expect(gap(second, first, back)).toBeCloseTo(expected, 2);
  });

  test('of a link that has turned, and an object or the ground', () => {
    const link = { link: 'upper', after: 1, position: [1, 0, 0], ...still, shape: { kind: 'sphere', radius: 0.1 } } as LinkShape;
    const setting = {
      scene: {
        objects: [
          { id: 'post', shape: { kind: 'cylinder' as const, radius: 0.2, length: 4 }, pose: { position: [0, 2, 0] } },
          { id: 'ground', shape: { kind: 'half_space' as const, normal: [0, 0, 2], offset: -0.5 } },
        ],
      },
    };
    const placed = placedOf(setting, arm);
    const [from, to] = pointsOf({ names: ['upper', 'post'], position: [Math.PI / 2] }, arm, [link], placed)!;
    close(from.toArray(), [0, 1.1, 0]);
    close(to.toArray(), [0, 1.8, 0]);
    const [lowest, below] = pointsOf({ names: ['upper', 'ground'], position: [Math.PI / 2] }, arm, [link], placed)!;
    close(lowest.toArray(), [0, 1, -0.1]);
    close(below.toArray(), [0, 1, -0.5]);
  });
});

describe('a scene', () => {
  const turned = { kind: 'rpy' as const, rpy: [0, 0, Math.PI / 2] };
  const setting = {
    mounting: { position: [0, 0, 1] },
    frames: { pallet: { position: [1, 0, 0], orientation: turned } },
    scene: {
      margin: 0.02,
      objects: [
        { id: 'in world', shape: ball, pose: { position: [0, 0, 1.5] } },
        { id: 'in base', shape: ball, pose: { position: [0, 0, 0.5] }, frame: 'base', margin: 0.1 },
        { id: 'on a pallet', shape: ball, pose: { position: [1, 0, 1] }, frame: 'pallet' },
      ],
      attached: [
        { id: 'part', shape: { kind: 'box' as const, size: [1, 1, 1] }, pose: { position: [0, 0, 0.2] } },
        { id: 'cable', shape: ball, link: 'upper' },
      ],
    },
  };

  test('stands in the base frame, what is held behind its joints', () => {
    const placed = placedOf(setting, arm);
    expect(placed.map(({ after }) => after)).toEqual([null, null, null, 1, 1]);
    expect(placed.map(({ margin }) => margin)).toEqual([0.02, 0.1, 0.02, 0, 0]);
    const expected = [
      [0, 0, 0.5],
      [0, 0, 0.5],
      [1, 1, 0],
      [1, 0, 0.3],
      [0.2, 0, 0],
    ];
    placed.forEach((one, index) => close(originOf(one), expected[index]!));
    expect(mountingOf(setting, arm).elements[14]).toBe(1);
  });

  test('is empty without one', () => {
    expect(placedOf({}, arm)).toEqual([]);
  });
});
