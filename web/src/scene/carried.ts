// What the robot takes on its way and puts down: where each of these objects is, and from when on.
import type { Matrix4 } from 'three';
import { plannedWaypoint } from '../plan/samples';
import { jointMatrices } from '../robot/chain';
import type { PlanAnswer, PlanRequest, Robot } from '../service/types';
import type { Placed } from './objects';

// Where things are until the next of these begins.
export interface Stretch {
  from: number; // s
  placed: readonly Placed[];
}

// A robot that takes things and puts them down, as it is planned.
export interface Carrier {
  request: PlanRequest;
  answer: PlanAnswer;
  robot: Robot;
  base: Matrix4; // where it stands, seen from the robot that is shown
  meetings?: ReadonlyMap<number, number>; // when others have arrived at one of its waypoints, too, s
}

// Where things are from the start on, and after each waypoint at which a robot takes or puts down; at one time what is put
// down comes first. Without a plan they are where they were at the start.
export function stretchesOf(placed: readonly Placed[], carriers: readonly Carrier[]): Stretch[] {
  const stretches: Stretch[] = [{ from: -Infinity, placed }];
  for (const { time, change } of carriers.flatMap(changesOf).sort((a, b) => a.time - b.time || a.order - b.order)) {
    const last = stretches.at(-1)!;
    const next = { from: time, placed: last.placed.map((one) => change(one, last.placed)) };
    if (last.from === time) stretches.pop();
    stretches.push(next);
  }
  return stretches;
}

interface Change {
  time: number; // s
  order: 0 | 1; // at one time
  change: (one: Placed, among: readonly Placed[]) => Placed;
}

// What the robot of a number takes and puts down.
function changesOf({ request, answer, robot, base, meetings }: Carrier, by: number): Change[] {
  return request.waypoints.flatMap((waypoint, index): Change[] => {
    const { attach = [], detach = [] } = waypoint;
    const planned = plannedWaypoint(answer, index);
    if (!planned || attach.length + detach.length === 0) return [];
    const time = meetings?.get(index) ?? planned.arrival_time;
    const joints = jointMatrices(robot, planned.position).map((matrix) => matrix.premultiply(base));
    const release = (one: Placed, among: readonly Placed[]): Placed => {
      if (!detach.includes(one.id) || one.after === null || one.by !== by) return one;
      const there = { ...one, after: null, matrix: joints[one.after]!.clone().multiply(one.matrix) };
      const under = 'on' in waypoint ? among.find(({ id }) => id === waypoint.on) : undefined;
      return under?.at ? { ...there, at: along(under.at, time, there.matrix) } : there;
    };
    const take = (one: Placed): Placed => {
      const link = attach.find(({ id }) => id === one.id)?.link ?? robot.tip_frame;
      const holder = robot.placements.find(({ frame }) => frame === link);
      if (one.after !== null || !holder || !attach.some(({ id }) => id === one.id)) return one;
      const matrix = (one.at?.(time) ?? one.matrix).clone();
      return { ...one, at: undefined, by, after: holder.after, matrix: matrix.premultiply(joints[holder.after]!.clone().invert()) };
    };
    return [
      { time, order: 0, change: release },
      { time, order: 1, change: take },
    ];
  });
}

// The pose of a thing that moves along, from a time on, with another one whose pose is known at any time.
function along(under: (time: number) => Matrix4, time: number, matrix: Matrix4): (time: number) => Matrix4 {
  const onObject = under(time).invert().multiply(matrix);
  return (later) => under(later).multiply(onObject);
}

// Where things are at a time, s; the same array until something is taken or put down, unless there are moving objects.
export function placedAt(stretches: readonly Stretch[], time: number): readonly Placed[] {
  const placed = stretches.findLast(({ from }) => from <= time)?.placed ?? [];
  return placed.some(({ at }) => at) ? placed.map((one) => (one.at ? { ...one, matrix: one.at(time) } : one)) : placed;
}
