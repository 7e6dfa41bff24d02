import { expect, test } from 'vitest';
import type { PlanRequest, Waypoint } from '../service/types';
import { jointWaypoint } from './edits';
import document from '../service/openapi.json';
import { inOrder, LEFT_OUT, orderRequest, runsOf } from './order';

const at = (value: number, more: object = {}): Waypoint => ({ ...jointWaypoint([value]), ...more });
const LINE = { motion: { kind: 'linear' } };
const relative = { kind: 'relative', move: { kind: 'cartesian', translation: [0, 0, 1] }, frame: 'tool' } as Waypoint;

const holes: PlanRequest = {
  robot: 'arm',
  duration: 9,
  waypoints: [at(0), at(1), relative, at(2, { motion: { kind: 'free' } }), at(3, LINE), at(4), at(0)],
  actions: [{ kind: 'set_output', name: 'drill', value: true, at: { waypoint: 2 } }],
};

test('runs begin where a motion of the joints leads, and the ends stay', () => {
  expect(runsOf(holes)).toEqual({ start: [0], tasks: [[1, 2], [3, 4], [5]], end: [6] });
});

test('a last waypoint on a line goes with its run, and a start with lines stays whole', () => {
  const seam: PlanRequest = { robot: 'arm', waypoints: [at(0), at(1, LINE), at(2), at(3), at(4, LINE)] };
  expect(runsOf(seam)).toEqual({ start: [0, 1], tasks: [[2], [3, 4]], end: [] });
  expect(orderRequest(seam)).toMatchObject({ start: at(1, LINE), tasks: [{}, {}], travel: { kind: 'joint' } });
  expect(orderRequest(seam)).not.toHaveProperty('end');
});

test('tasks begin without a motion of their own, and travel is free if one of them was', () => {
  const asked = orderRequest(holes);
  expect(asked.tasks.map(({ waypoints }) => (waypoints[0] as Waypoint).motion)).toEqual([undefined, undefined, undefined]);
  expect(asked.travel).toEqual({ kind: 'free' });
  expect(asked).not.toHaveProperty('duration');
  expect(asked).not.toHaveProperty('actions');
});

test('the waypoints follow the order, with their actions', () => {
  const next = inOrder(holes, [2, 0, 1]);
  const values = next.waypoints.map((waypoint) => (waypoint.kind === 'joint' ? waypoint.position[0] : 'move'));
  expect(values).toEqual([0, 4, 1, 'move', 2, 3, 0]);
  expect(next.actions![0]!.at.waypoint).toBe(3);
  expect(next.duration).toBe(9);
});

test('all fields are left out that requests of tasks do not have', () => {
  const { PlanRequest, OrderRequest } = document.components.schemas;
  const unknown = Object.keys(PlanRequest.properties).filter((name) => !(name in OrderRequest.properties));
  expect(LEFT_OUT.filter((name) => name !== 'time_budget').toSorted()).toEqual(unknown.toSorted());
});
