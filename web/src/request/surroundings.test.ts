import { Matrix4, Quaternion as Turn, Vector3 } from 'three';
import { describe, expect, test } from 'vitest';
import type { PlanRequest, Pose, Robot, Scene } from '../service/types';
import { composed } from './poses';
import type { Quaternion } from './rotations';
import { surroundingsOf } from './surroundings';

const box = { kind: 'box' as const, size: [0.1, 0.1, 0.1] };
const robot = { id: 'arm', tip_frame: 'flange', tool: { position: [0, 0, 0.1], quaternion_xyzw: [0, 0, 0, 1] } } as unknown as Robot;
const scene: Scene = {
  objects: [
    { id: 'table', shape: box },
    { id: 'part', shape: box },
  ],
  attached: [
    { id: 'gripper', shape: box, touch_links: ['hand', 'part'], pose: { position: [0, 0, 0.02] } },
    { id: 'cable', shape: box, link: 'upper' },
  ],
  allowed_pairs: [
    ['table', 'base'],
    ['part', 'table'],
  ],
  margin: 0.01,
};
const first = { kind: 'joint' as const, position: [0] };
const asked: PlanRequest = { robot: 'arm', waypoints: [first, first], scene, mounting: { position: [0, 0, 1] } };

describe('a pose is held against', () => {
  test('the scene as it stands, or its id, where nothing is moved in it', () => {
    expect(surroundingsOf(asked, scene, 1, robot)).toEqual({
      scene,
      self_collision: undefined,
      frames: undefined,
      mounting: asked.mounting,
    });
    expect(surroundingsOf({ ...asked, scene: 'cell' }, scene, 1, robot).scene).toBe('cell');
    expect(surroundingsOf({ ...asked, scene: 'cell' }, null, 1, robot).scene).toBe('cell');
  });

  test('itself alone, or nothing, without a scene', () => {
    expect(surroundingsOf({ robot: 'arm', waypoints: asked.waypoints, self_collision: true }, null, 1, robot)).toEqual({
      self_collision: true,
    });
  });

  test('all but what is taken on the way, in whatever place that is named', () => {
    const taking = { ...asked, waypoints: [first, { ...first, attach: [{ id: 'part' }] }, { ...first, detach: ['part'] }] };
    const { scene: left } = surroundingsOf(taking, scene, 2, robot) as { scene: Scene };
    expect(JSON.stringify(left)).not.toContain('part');
    expect(left.objects).toEqual([scene.objects![0]]);
    expect(left.allowed_pairs).toEqual([['table', 'base']]);
    expect(left.margin).toBe(0.01);
    expect(JSON.stringify(scene)).toContain('part');
  });

  test("what is held at the request's tool, where it is held, when the waypoint has another tool", () => {
    const tool = { position: [0, 0, 0.3] };
    const other = { ...asked, waypoints: [first, { ...first, tool }] };
    const { scene: moved } = surroundingsOf(other, scene, 1, robot) as { scene: Scene };
    expect(moved.attached![0]).toMatchObject({ id: 'gripper', link: 'flange', touch_links: ['hand', 'part'] });
    [0, 0, 0.12].forEach((value, axis) => expect(moved.attached![0]!.pose!.position[axis]).toBeCloseTo(value, 12));
    expect(moved.attached![1]).toEqual(scene.attached![1]);
  });
});

test('a pose in the frame of another is where the product of their matrices has it', () => {
  const turned = (x: number, y: number, z: number, w: number): Quaternion => new Turn(x, y, z, w).normalize().toArray();
  const frame: Pose = { position: [1, -2, 0.5], orientation: { kind: 'quaternion', xyzw: turned(0.3, -0.2, 0.7, 0.4) } };
  const pose: Pose = { position: [0.2, 0.4, -3], orientation: { kind: 'quaternion', xyzw: turned(-0.5, 0.1, 0.2, 0.8) } };
  const matrix = ({ position, orientation }: Pose): Matrix4 =>
    new Matrix4().compose(
      new Vector3().fromArray(position),
      new Turn().fromArray((orientation as { xyzw: number[] }).xyzw),
      new Vector3(1, 1, 1),
    );
  const expected = matrix(frame).multiply(matrix(pose)).elements;
  matrix(composed(frame, pose)).elements.forEach((value, i) => expect(value).toBeCloseTo(expected[i]!, 12));
});
