import { describe, expect, test } from 'vitest';
import { slowTimes, zoneNotes } from '../plan/zones';
import type { FreeMotion, PlanAnswer, PlanRequest, SpeedZoneAnswer } from '../service/types';
import { budgeted, optimised } from './motions';
import { aboutObject, withAnotherZone, withoutZone, withZone, zonesOf } from './zones';

const bare: PlanRequest = {
  robot: 'arm',
  waypoints: [
    { kind: 'joint', position: [0] },
    { kind: 'joint', position: [1] },
  ],
};

describe('speed zones', () => {
  test('make steps, each half as wide and half as fast, about the same objects', () => {
    const one = withAnotherZone(bare);
    const about = withZone(one, 0, { objects: ['walkway'], clearance: 0.8 });
    expect(zonesOf(withAnotherZone(about))[1]).toEqual({ clearance: 0.4, speed: zonesOf(one)[0]!.speed / 2, objects: ['walkway'] });
  });

  test('leave nothing behind when they go', () => {
    expect(withoutZone(withAnotherZone(bare), 0)).toEqual(bare);
    expect(zonesOf(bare)).toEqual([]);
  });

  test('are about all that stand still unless objects are named', () => {
    const zone = { clearance: 0.3, speed: 0.2 };
    const named = aboutObject(aboutObject(zone, 'a', true), 'b', true);
    expect(named).toEqual({ ...zone, objects: ['a', 'b'] });
    expect(aboutObject(aboutObject(named, 'a', false), 'b', false)).toEqual(zone);
  });

  test('allow the least speed where they overlap', () => {
    const speed_zones = [
      {
        limit: 0.6,
        intervals: [
          [1, 5],
          [7, 8],
        ],
      },
      { limit: 0.25, intervals: [[2, 3]] },
    ];
    expect(slowTimes({ certificate: { speed_zones } } as unknown as PlanAnswer)).toEqual([
      { from: 1, to: 2, limit: 0.6 },
      { from: 2, to: 3, limit: 0.25 },
      { from: 3, to: 5, limit: 0.6 },
      { from: 7, to: 8, limit: 0.6 },
    ]);
    expect(slowTimes({ certificate: {} } as unknown as PlanAnswer)).toEqual([]);
  });

  test('tell which link is fastest and when it may be too fast', () => {
    const zone = {
      objects: ['walkway'],
      intervals: [
        [1, 2.5],
        [4, 5],
      ],
      link: 'link_3',
      exceeded: [[4.125, 4.5]],
    };
    expect(zoneNotes(zone as unknown as SpeedZoneAnswer)).toEqual({
      about: 'to walkway, 1.00 to 2.50, 4.00 to 5.00 s',
      fastest: 'fastest: link_3',
      exceeded: 'may be too fast: 4.13 to 4.50 s',
    });
    const never = { objects: null, intervals: [], link: null, exceeded: [] };
    expect(zoneNotes(never as unknown as SpeedZoneAnswer)).toEqual({
      about: 'to all that stand still, it is never so near',
      fastest: null,
      exceeded: null,
    });
  });
});

describe('free motions', () => {
  const motion: FreeMotion = { kind: 'free', most_checks: 100 };

  test('lose what bounds their improvement with the improvement', () => {
    const better = budgeted(optimised(motion, 'effort'), 2);
    expect(better).toEqual({ ...motion, optimise: 'effort', time_budget: 2 });
    expect(optimised(better, null)).toEqual(motion);
    expect(budgeted(better, undefined)).toEqual({ ...motion, optimise: 'effort' });
  });
});
