import { Vector3 } from 'three';
import { expect, test } from 'vitest';
import type { PlanRequest, Robot, Waypoint } from '../service/types';
import { arc, extentOf, placesOf, withPath } from './paths';

const random = (): number => 2 * Math.random() - 1;
const vector = (values: readonly number[]): Vector3 => new Vector3().fromArray(values);
const request: PlanRequest = { robot: 'arm', waypoints: [{ kind: 'joint', position: [0] }] };
const arm = { mounting: null } as unknown as Robot;
const pose = (...position: number[]) => ({ position, orientation: { kind: 'rpy' as const, rpy: [0, 0, 0] } });
const at = { position: [1, 0, 0], orientation: { kind: 'rpy' as const, rpy: [0, 0, Math.PI / 2] } };
const path: Waypoint[] = [
  { kind: 'pose', frame: 'path', pose: pose(0, 0, 0) },
  { kind: 'pose', frame: 'path', pose: pose(0.2, 0, 0), motion: { kind: 'polyline', poses: [pose(0.1, 0.1, 0)], blend: 0.01 } },
];

test('an arc is round, in one plane, and leads past its middle point to its end', () => {
  for (let k = 0; k < 200; k += 1) {
    const [middle, x] = [new Vector3(random(), random(), random()), new Vector3(random(), random(), random())];
    const y = new Vector3(random(), random(), random()).cross(x).setLength(x.length());
    const on = (angle: number): Vector3 => middle.clone().addScaledVector(x, Math.cos(angle)).addScaledVector(y, Math.sin(angle));
    const end = 0.2 + 5.5 * Math.random();
    const points = arc(on(0).toArray(), on(end * (0.2 + 0.6 * Math.random())).toArray(), on(end).toArray()).map(vector);
    points.forEach((point, i) => expect(point.distanceTo(on((end * (i + 1)) / points.length))).toBeLessThan(1e-6));
  }
});

test('an arc of points on a line is the line', () => {
  expect(arc([0, 0, 0], [1, 1, 0], [2, 2, 0])).toEqual([
    [1, 1, 0],
    [2, 2, 0],
  ]);
});

test('a path is where its frame is, with its corners and its extent', () => {
  const shown = withPath(request, path, at, false);
  const { poses, line } = placesOf(shown, path, arm);
  expect(poses).toHaveLength(2);
  const expected = [
    [1, 0, 0],
    [0.9, 0.1, 0],
    [1, 0.2, 0],
  ];
  line.forEach((point, i) => expect(vector(point).distanceTo(vector(expected[i]!))).toBeLessThan(1e-12));
  const { from, to } = extentOf(line)!;
  expect(
    vector(to)
      .sub(vector(from))
      .distanceTo(new Vector3(0.1, 0.2, 0)),
  ).toBeLessThan(1e-12);
  expect(extentOf([])).toBeNull();
});

test('a path comes behind the waypoints or in their place, with its frame', () => {
  expect(withPath(request, path, at, true)).toEqual({ ...request, waypoints: [...request.waypoints, ...path], frames: { path: at } });
  expect(withPath(request, path, at, false).waypoints).toEqual(path);
  const joints: Waypoint[] = [{ kind: 'joint', position: [1] }];
  expect(withPath(request, joints, at, true)).toEqual({ ...request, waypoints: [...request.waypoints, ...joints] });
});
