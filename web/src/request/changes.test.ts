import { expect, test } from 'vitest';
import { changeInWords, fieldInWords, pointerOf } from './changes';

const place = (index: number): string => `waypoint ${index}`;

test.each([
  ['/waypoints/2/duration', 1.23456, 'waypoint 2, duration: 1.235 s'],
  ['/limits/tcp_linear_velocity', 0.25, 'limits, tool linear velocity: 250 mm/s'],
  ['/duration', null, 'duration: none'],
  ['/waypoints/1/transition', { kind: 'blend', radius: 0.05 }, 'waypoint 1, transition: blend, radius 50 mm'],
  ['/waypoints/1', { kind: 'named', name: 'home' }, 'waypoint 1: named, name home'],
  ['/waypoints/3/motion/kind', 'free', 'waypoint 3, motion, kind: free'],
  ['/limits/joint_velocity', [1, 2.5], 'limits, joint velocity: 1, 2.5'],
  ['/self_collision', false, 'self collision: no'],
])('%s = %j reads "%s"', (pointer, value, words) => {
  expect(changeInWords(pointer, value, place)).toBe(words);
});

test.each([
  ['limits.tcp_linear_velocity', 'limits, tool linear velocity'],
  ['waypoints[2].limits.velocity', 'waypoint 2, limits, velocity'],
  ['robot.acceleration', 'robot, acceleration'],
])('the field %s of an answer reads "%s"', (name, words) => {
  expect(fieldInWords(pointerOf(name), place)).toBe(words);
});
