import { expect, test } from 'vitest';
import type { PlanRequest, PoseWaypoint, Robot } from '../service/types';
import { poseAsGiven, poseInBase } from './places';

const robot = { mounting: null } as Robot;
const turned = { kind: 'rpy' as const, rpy: [0, 0, Math.PI / 2] };
const part = {
  id: 'part',
  shape: { kind: 'sphere', radius: 0.1 },
  frame: 'belt',
  pose: { position: [1, 0, 0], orientation: { kind: 'rpy', rpy: [0, 0, 0] } },
  motion: { kind: 'linear', velocity: [0.5, 0, 0], end: 3 },
};
const request = {
  frames: { belt: { position: [0, 0, 1], orientation: turned } },
  scene: { objects: [part] },
} as unknown as PlanRequest;
const waypoint = { kind: 'pose', on: 'part', pose: { position: [0, 0.2, 0.3], orientation: turned } } as PoseWaypoint;

test('a pose on an object is where the object is at that time, until it stops', () => {
  for (const [time, x] of [
    [0, 1],
    [2, 2],
    [9, 2.5],
  ] as const) {
    const at = poseInBase(waypoint, request, robot, time)!;
    [-0.2, x, 1.3].forEach((value, axis) => expect(at.position[axis]).toBeCloseTo(value, 12));
    const back = poseAsGiven(at, waypoint, request, robot, time);
    waypoint.pose.position.forEach((value, axis) => expect(back.position[axis]).toBeCloseTo(value, 12));
  }
});

test('a pose on an object that is not there has no place, and stays as it is', () => {
  const lost = { ...waypoint, on: 'other' };
  expect(poseInBase(lost, request, robot)).toBeNull();
  expect(poseAsGiven(waypoint.pose, lost, request, robot)).toBe(waypoint.pose);
});
