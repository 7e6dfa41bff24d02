import { expect, test } from 'vitest';
import type { PlanRequest, Robot, Scene } from '../service/types';
import { jointMatrices } from '../robot/chain';
import { matrixOfPose, placedOf } from '../scene/objects';
import {
  attachedInBase,
  inFrame,
  objectInBase,
  onLink,
  renamed,
  withAllowedPair,
  withAnother,
  withAttached,
  withNewName,
  withObject,
  withoutAllowedPair,
  withoutObject,
} from './scenes';

const scene: Scene = {
  objects: [
    { id: 'box', shape: { kind: 'box', size: [1, 1, 1] } },
    { id: 'post', shape: { kind: 'sphere', radius: 1 } },
  ],
  attached: [{ id: 'held', shape: { kind: 'sphere', radius: 1 }, touch_links: ['box', 'link_1'] }],
  allowed_pairs: [
    ['box', 'link_2'],
    ['post', 'held'],
  ],
};

test('a new name goes to all places that had the old one', () => {
  const next = renamed(scene, 'box', 'table')!;
  expect(JSON.stringify(next)).toBe(
    JSON.stringify(scene)
      .replaceAll('"box","shape"', '"table","shape"')
      .replace('["box","link_1"]', '["table","link_1"]')
      .replace('["box","link_2"]', '["table","link_2"]'),
  );
});

test('a new name goes to waypoints, options and speed zones', () => {
  const taking = { kind: 'joint' as const, position: [0], attach: [{ id: 'box' }, { id: 'post', touch_links: ['box'] }] };
  const placing = { kind: 'named' as const, name: 'box', detach: ['box'] };
  const request: PlanRequest = {
    robot: 'box',
    waypoints: [taking, { kind: 'any_of', options: [placing, { kind: 'sequence', waypoints: [taking, placing] }] }],
    speed_zones: [{ clearance: 1, speed: 1, objects: ['box', 'post'] }],
  };
  expect(JSON.stringify(withNewName(request, 'box', 'table'))).toBe(
    JSON.stringify(request).replaceAll('{"id":"box"}', '{"id":"table"}').replaceAll('["box"', '["table"'),
  );
});

test.each(['post', 'held', 'box', ''])('an object cannot get the name "%s"', (name) => {
  expect(renamed(scene, 'box', name)).toBeNull();
});

test('objects that are added have names of their own', () => {
  let next = scene;
  const ids = Array.from({ length: 3 }, () => {
    const [with_, added] = withAnother(next, 'box', { kind: 'sphere', radius: 1 });
    next = with_;
    return added.id;
  });
  expect(ids).toEqual(['box_2', 'box_3', 'box_4']);
  expect(next.objects).toHaveLength(5);
});

test('what is taken away leaves no allowed pair behind', () => {
  const next = withoutObject(scene, 'box');
  expect(next.objects?.map(({ id }) => id)).toEqual(['post']);
  expect(next.allowed_pairs).toEqual([['post', 'held']]);
  expect(withObject(scene, 'box', { margin: 0.1 }).objects?.map(({ margin }) => margin)).toEqual([0.1, undefined]);
});

test('an object stays where it is when its frame changes', () => {
  const turn = { kind: 'quaternion' as const, xyzw: [0, 0, Math.sin(0.4), Math.cos(0.4)] };
  const frames = { bench: { position: [1, 2, 3], orientation: turn } };
  const request = { robot: 'a', waypoints: [], frames, mounting: { position: [0.3, 0, 1], orientation: turn } } as unknown as PlanRequest;
  const robot = { mounting: null } as unknown as Robot;
  const object = { id: 'box', shape: { kind: 'box' as const, size: [1, 1, 1] }, pose: { position: [0.5, 0.6, 0.7], orientation: turn } };
  const before = objectInBase(object, request, robot)!;
  for (const frame of ['base', 'bench', 'world']) {
    const next = { ...object, ...inFrame(object, frame, request, robot) };
    expect(next.frame).toBe(frame);
    const after = objectInBase(next, request, robot)!;
    after.position.forEach((value, axis) => expect(value).toBeCloseTo(before.position[axis]!, 9));
  }
  const bench = inFrame(object, 'bench', request, robot).pose!;
  // By hand: the bench's axes are turned by 0.8 rad about z.
  const [dx, dy] = [0.5 - 1, 0.6 - 2];
  expect(bench.position[0]).toBeCloseTo(Math.cos(0.8) * dx + Math.sin(0.8) * dy, 9);
  expect(bench.position[1]).toBeCloseTo(-Math.sin(0.8) * dx + Math.cos(0.8) * dy, 9);
  expect(bench.position[2]).toBeCloseTo(0.7 - 3, 9);
});

test('an attached object is renamed, changed and taken away like the others', () => {
  const next = renamed(scene, 'held', 'cup')!;
  expect(JSON.stringify(next)).toBe(JSON.stringify(scene).replaceAll('"held"', '"cup"'));
  expect(withObject(scene, 'held', { margin: 0.01, link: 'link_1' }).attached).toEqual([
    { ...scene.attached![0], margin: 0.01, link: 'link_1' },
  ]);
  const [more, added] = withAttached(scene, 'box', { kind: 'sphere', radius: 0.1 });
  expect(added.id).toBe('box_2');
  expect(more.attached).toEqual([...scene.attached!, added]);
  const left = withoutObject(scene, 'held');
  expect([left.attached, left.allowed_pairs]).toEqual([[], [['box', 'link_2']]]);
  expect(withoutObject(scene, 'box').attached![0]!.touch_links).toEqual(['link_1']);
});

test('a pair may touch once, in any order, and no object with itself', () => {
  const next = withAllowedPair(scene, 'link_3', 'box');
  expect(next.allowed_pairs).toEqual([...scene.allowed_pairs!, ['link_3', 'box']]);
  expect(withAllowedPair(next, 'box', 'link_3')).toBe(next);
  expect(withAllowedPair(scene, 'box', 'box')).toBe(scene);
  expect(withoutAllowedPair(next, 0).allowed_pairs).toEqual([
    ['post', 'held'],
    ['link_3', 'box'],
  ]);
});

// The matrices of three say where the stage draws it.
test.each([null, 'upper'])('an object on %s is dragged where it is drawn', (link) => {
  const still = { quaternion_xyzw: [0, 0, 0, 1] };
  const turned = { quaternion_xyzw: [0, Math.sin(0.3), 0, Math.cos(0.3)] };
  const robot = {
    joints: [
      { name: 'a', kind: 'revolute' },
      { name: 'b', kind: 'prismatic' },
    ],
    chain: [
      { position: [0, 0, 0.4], ...turned, axis: [0, 0, 1] },
      { position: [1, 0, 0], ...still, axis: [0, 1, 0] },
    ],
    placements: [
      { frame: 'upper', after: 1, position: [0.5, 0, 0], ...turned },
      { frame: 'tip', after: 2, position: [1, 0.2, 0], ...turned },
    ],
    tip_frame: 'tip',
    tool: { position: [0, 0, 0.1], ...still },
  } as unknown as Robot;
  const tool = { position: [0.1, 0, 0.2], orientation: { kind: 'quaternion' as const, xyzw: turned.quaternion_xyzw } };
  const request = { robot: 'a', waypoints: [], tool } as unknown as PlanRequest;
  const pose = { position: [0.1, 0.2, 0.3], orientation: { kind: 'quaternion' as const, xyzw: [0, 0, Math.sin(0.4), Math.cos(0.4)] } };
  const held = { id: 'cup', shape: { kind: 'sphere' as const, radius: 1 }, pose, link };
  const position = [0.7, 0.3];
  const found = attachedInBase(held, request, robot, position);
  const [placed] = placedOf({ tool, scene: { attached: [held] } }, robot);
  const drawn = jointMatrices(robot, position)[placed!.after!]!.clone().multiply(placed!.matrix);
  const close = (one: readonly number[], other: readonly number[]): void =>
    one.forEach((value, index) => expect(value).toBeCloseTo(other[index]!, 9));
  close(matrixOfPose(found).elements, drawn.elements);
  const back = onLink(found, link, request, robot, position);
  close(matrixOfPose(back).elements, matrixOfPose(pose).elements);
});
