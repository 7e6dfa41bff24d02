import { describe, expect, test } from 'vitest';
import type { CellRequest, PlanRequest } from '../service/types';
import { fromFragment, toFragment } from './address';
import {
  cellOf,
  remediedCell,
  robotsOf,
  sharedNames,
  shownOf,
  showing,
  withMeeting,
  withName,
  withoutRobot,
  withRobot,
  withWaits,
} from './cells';
import { codeOf } from './code';
import { withWaypoint } from './edits';
import { inOrder, orderRequest } from './order';
import { parseRequest } from './parse';

const FILES = import.meta.glob<CellRequest>('../../../examples/cell/*.json', { import: 'default', eager: true });
const read = (name: string): CellRequest => structuredClone(FILES[`../../../examples/cell/${name}.json`]!);
const handover = read('handover');
const stored: CellRequest = { ...read('over_a_table'), scene: 'table_1' };
stored.robots[1]!.attached = [{ id: 'cup', shape: { kind: 'sphere', radius: 0.05 } }];

describe('a robot of a cell', () => {
  test.each([handover, read('over_a_table'), stored])('is a request by itself, and leads back to the same cell', (cell) => {
    cell.robots.forEach((member, index) => {
      const shown = shownOf(cell, index);
      expect(shown.waypoints).toEqual(member.waypoints);
      expect(cellOf(shown)).toEqual(cell);
      expect(robotsOf(shown).map((own) => own.cell!.name)).toEqual(['left', 'right']);
    });
  });

  test('is edited in its place, with another one shown too', () => {
    const edited = withWaypoint(shownOf(handover, 1), 2, { dwell: 0.7 });
    expect(cellOf(edited)!.robots[1]!.waypoints[2]!.dwell).toBe(0.7);
    expect(cellOf(edited)!.robots[0]).toEqual(handover.robots[0]);
    expect(cellOf(showing(edited, 0))).toEqual(cellOf(edited));
  });

  test('has its waits as rests where it goes on later', () => {
    const shown = shownOf(handover, 1);
    const { waypoints, ...rest } = withWaits(shown, [0, 0.878, 0.1, 0]);
    expect(waypoints.map(({ dwell }) => dwell)).toEqual([undefined, 1.178, 0.4, undefined]);
    expect('cell' in rest).toBe(false);
  });

  test('is put in order without the others, which stay', () => {
    const shown = shownOf(handover, 0);
    expect(Object.keys(orderRequest(shown))).not.toContain('cell');
    expect(cellOf(inOrder(shown, [1, 0]))!.robots[1]).toEqual(handover.robots[1]);
  });
});

describe('a cell', () => {
  const plain: PlanRequest = { robot: 'ur5e', waypoints: [{ kind: 'named', name: 'home' }], scene: { objects: [], margin: 0.01 } };

  test('begins with a request and a robot like it, beside it, and ends with the last robot', () => {
    const two = withRobot(plain);
    const { robots, scene } = cellOf(two)!;
    expect(robots.map(({ name }) => name)).toEqual(['ur5e', 'ur5e_2']);
    expect(robots[1]!.mounting!.position).toEqual([1.5, 0, 0]);
    expect(scene).toEqual(plain.scene);
    expect(two.cell!.index).toBe(1);
    expect(robotsOf(withRobot(two))).toHaveLength(3);
    expect(withoutRobot(two)).toEqual(plain);
  });

  test('renames a robot in pairs, unless another one has the name', () => {
    expect(withName(shownOf(handover, 0), 'right')).toBeNull();
    const { robots, allowed_pairs } = cellOf(withName(shownOf(handover, 0), 'west')!)!;
    expect(robots.map(({ name }) => name)).toEqual(['west', 'right']);
    expect(allowed_pairs).toEqual([
      ['west/bar', 'right/link_6'],
      ['right/bar', 'west/link_6'],
    ]);
  });

  test('has meetings where several robots have a waypoint of one name, in order', () => {
    const table = shownOf(read('over_a_table'), 0);
    expect(sharedNames(table)).toEqual(['away', 'reach', 'away again']);
    const met = withMeeting(withMeeting(table, 'away again', true), 'reach', true);
    expect(cellOf(met)!.meetings).toEqual(['reach', 'away again']);
    expect(cellOf(withMeeting(withMeeting(met, 'reach', false), 'away again', false))).toEqual(read('over_a_table'));
  });

  test('takes remedies at their place', () => {
    const remedy = { change: '/robots/1/waypoints/2/duration', value: 2.5, explanation: '' };
    expect(cellOf(remediedCell(shownOf(handover, 0), [remedy]))!.robots[1]!.waypoints[2]!.duration).toBe(2.5);
  });

  test('is read from a text and from a link, with the robot that was shown', async () => {
    expect(parseRequest(JSON.stringify(handover)).request).toEqual(shownOf(handover, 0));
    const shown = shownOf(handover, 1);
    expect(await fromFragment(await toFragment({ request: shown, time: 1.5 }))).toEqual({ request: shown, time: 1.5 });
    const { fault } = parseRequest(
      JSON.stringify({ ...handover, robots: [{ ...handover.robots[0], name: 'left arm' }, handover.robots[1]] }),
    );
    expect(fault).toContain('/robots/0/name');
  });

  test('is code that posts the cell', () => {
    const [, address, body] = /^curl -s (\S+) --json '(.*)'$/s.exec(codeOf('curl', shownOf(handover, 1), 'http://host'))!;
    expect(address).toBe('http://host/v1/cells/plan');
    expect(JSON.parse(body!)).toEqual(handover);
  });
});
