import { describe, expect, test } from 'vitest';
import type { PlanRequest } from '../service/types';
import { inserted, jointWaypoint, moved, remedied, removed, setAt, waysOf, withWaypoint } from './edits';

const three: PlanRequest = { robot: 'arm', waypoints: [0, 1, 2].map((i) => ({ ...jointWaypoint([i]), name: `P${i}` })) };
const names = (request: PlanRequest): unknown[] => request.waypoints.map(({ name }) => name);

describe('waypoints', () => {
  test('are inserted, moved and removed without changing the request before', () => {
    const before = structuredClone(three);
    expect(names(inserted(three, 0, { ...jointWaypoint([9]), name: 'new' }))).toEqual(['P0', 'new', 'P1', 'P2']);
    expect(names(moved(three, 0, 2))).toEqual(['P1', 'P2', 'P0']);
    expect(names(moved(three, 2, 0))).toEqual(['P2', 'P0', 'P1']);
    expect(names(removed(three, 1))).toEqual(['P0', 'P2']);
    expect(three).toEqual(before);
  });

  test('stay where they cannot go', () => {
    expect(moved(three, 0, -1)).toBe(three);
    expect(moved(three, 2, 3)).toBe(three);
    const two = removed(three, 0);
    expect(removed(two, 0)).toBe(two);
  });

  test('take their actions with them', () => {
    const output = (at: object): object => ({ kind: 'set_output', name: 'gripper', value: true, at });
    const actions = [output({ waypoint: 0 }), output({ waypoint: 2 }), output({ time: 1 })];
    const acting = { ...three, actions } as PlanRequest;
    const places = (request: PlanRequest): unknown[] => request.actions!.map(({ at }) => at);
    expect(places(moved(acting, 2, 0))).toEqual([{ waypoint: 1 }, { waypoint: 0 }, { time: 1 }]);
    expect(places(inserted(acting, 0, jointWaypoint([9])))).toEqual([{ waypoint: 0 }, { waypoint: 3 }, { time: 1 }]);
    expect(places(removed(acting, 0))).toEqual([{ waypoint: 1 }, { time: 1 }]);
    expect(places(acting)).toEqual([{ waypoint: 0 }, { waypoint: 2 }, { time: 1 }]);
  });

  test('lose the fields that are taken away', () => {
    const dwelling = withWaypoint(three, 1, { dwell: 2, duration: 3 });
    expect(withWaypoint(dwelling, 1, { dwell: undefined }).waypoints[1]).toEqual({ ...three.waypoints[1], duration: 3 });
  });
});

describe('remedies', () => {
  const remedies = [
    { change: '/waypoints/1/duration', value: 2, explanation: '' },
    { change: '/waypoints/2/duration', value: 3, explanation: '' },
    { change: '/limits/torque', value: [1], explanation: '' },
    { change: '/payload/mass', value: 4, explanation: '' },
    { change: '/backend', value: { kind: 'ruckig' }, explanation: '' },
    { change: '/waypoints/1/limits/velocity', value: [2], explanation: '' },
  ];

  test('of one kind belong together', () => {
    expect(waysOf(remedies).map(({ kind, remedies: { length } }) => [kind, length])).toEqual([
      ['durations', 2],
      ['limits', 2],
      ['payload', 1],
      ['other', 1],
    ]);
  });

  test('are put where their pointers say', () => {
    const changed = remedied(three, remedies);
    expect(changed.waypoints[1]).toMatchObject({ duration: 2, limits: { velocity: [2] } });
    expect(changed).toMatchObject({ limits: { torque: [1] }, payload: { mass: 4 }, backend: { kind: 'ruckig' } });
    expect(three.waypoints[1]).not.toHaveProperty('duration');
  });

  test('name keys with escaped signs (RFC 6901)', () => {
    const document = { 'a/b': { 'm~n': 1 } };
    setAt(document, '/a~1b/m~0n', 2);
    expect(document).toEqual({ 'a/b': { 'm~n': 2 } });
    expect(() => setAt(document, '', 1)).toThrow();
  });

  test.each(['/robot/x', '/waypoints/first', '/waypoints/9', '/duration/x', '/__proto__/x'])(
    'sets nothing where there is no place: %s',
    (pointer) => {
      const document = { robot: 'arm', waypoints: [{}], duration: 1 };
      expect(setAt(document, pointer, 1)).toBe(false);
      expect(document).toEqual({ robot: 'arm', waypoints: [{}], duration: 1 });
    },
  );

  test('sets what lies deep where nothing is yet', () => {
    const document = { waypoints: [{}] };
    expect(setAt(document, '/waypoints/0/limits/velocity_scale', 0.5)).toBe(true);
    expect(document).toEqual({ waypoints: [{ limits: { velocity_scale: 0.5 } }] });
  });
});
