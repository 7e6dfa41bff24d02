import { expect, test } from 'vitest';
import type { PlanRequest, Solution } from '../service/types';
import { configured, isSolution, unconfigured } from './configurations';

const pose = { position: [1, 0, 0], orientation: null };
const request = {
  robot: 'arm',
  waypoints: [
    { kind: 'joint', position: [0] },
    { kind: 'pose', name: 'P', pose, dwell: 2, frame: 'pallet' },
  ],
} as PlanRequest;
const solution = (value: number, elbow: string | null, wrist: string | null = null): Solution =>
  ({ position: [value], configuration: { shoulder: null, elbow, wrist } }) as unknown as Solution;

test('a solution that its names tell from all others is asked for by them', () => {
  const all = [solution(1, 'up', 'flip'), solution(2, 'up', 'no_flip'), solution(3, 'down', 'flip')];
  const asked = configured(request, 1, all[1]!, all);
  expect(asked.waypoints[1]).toEqual({ ...request.waypoints[1], configuration: { elbow: 'up', wrist: 'no_flip' } });
  expect(unconfigured(asked, 1)).toEqual(request);
});

test.each([
  ['whole turns apart', [solution(1.23456789, 'up'), solution(7.5, 'up')]],
  ['of an arm without such names', [solution(1.23456789, null), solution(2, null)]],
  ['beside a singular one, which is on both sides', [solution(1.23456789, 'up'), solution(2, null)]],
])('one of several %s is asked for by its joint position', (_, all) => {
  const asked = configured(request, 1, all[0]!, all);
  expect(asked.waypoints).toEqual([request.waypoints[0], { kind: 'joint', name: 'P', dwell: 2, position: [1.234568] }]);
  expect(request.waypoints[1]).toHaveProperty('pose');
});

test('an arm stands in a way to rounding error, and not a whole turn away', () => {
  expect(isSolution([1.0000001], solution(1, 'up'))).toBe(true);
  expect(isSolution([1 + 2 * Math.PI], solution(1, 'up'))).toBe(false);
});
