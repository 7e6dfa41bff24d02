import { expect, test } from 'vitest';
import { shownOf } from '../request/cells';
import type { CellRequest, Problem } from '../service/types';
import { ownProblem, problem, refusedRobots, request } from './store';

const member = (name: string): CellRequest['robots'][number] => ({ name, robot: 'arm', waypoints: [{ kind: 'named', name: 'home' }] });
const cell: CellRequest = { robots: ['left', 'right', 'third'].map(member) };
const refused = (fields: Partial<Problem>): Problem => ({ code: 'collision', ...fields }) as Problem;

test('a refusal belongs to the robot that it names, or whose fields are at fault', () => {
  request.value = shownOf(cell, 0);
  for (const fields of [{ robot: 1 }, { errors: [{ pointer: '/robots/1/waypoints/0', message: '' }] }]) {
    problem.value = refused(fields);
    expect(refusedRobots.value).toEqual([1]);
    expect(ownProblem.value).toBeNull();
  }
  request.value = shownOf(cell, 1);
  expect(ownProblem.value).toBe(problem.value);
});

test('of two robots that touch, the joint position is that of the first', () => {
  problem.value = refused({ pair: ['third/link_3', 'left/link_2'], position: [1], point: [0, 0, 1] });
  request.value = shownOf(cell, 0);
  expect(refusedRobots.value).toEqual([2, 0]);
  expect(ownProblem.value).toBeNull();
  request.value = shownOf(cell, 2);
  expect(ownProblem.value).toMatchObject({ position: [1], point: null });
});

test('a refusal of all robots, or of a request by itself, is shown as it is', () => {
  problem.value = refused({ pair: ['link_3', 'table'], position: [1] });
  request.value = shownOf(cell, 0);
  expect(ownProblem.value).toBe(problem.value);
  request.value = { robot: 'arm', waypoints: [] };
  problem.value = refused({ errors: [{ pointer: '/robots/1', message: '' }] });
  expect(ownProblem.value).toBe(problem.value);
});
