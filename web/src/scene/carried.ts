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

// Where things are from the start on, and after each waypoint that takes or puts down; at one waypoint what is put down
// comes first. Without a plan they are where they were at the start.
export function stretchesOf(
  placed: readonly Placed[],
  request: PlanRequest | undefined,
  answer: PlanAnswer | undefined,
  robot: Robot,
): Stretch[] {
  const stretches: Stretch[] = [{ from: -Infinity, placed }];
  if (!request || !answer) return stretches;
  let now = placed;
  request.waypoints.forEach(({ attach = [], detach = [] }, index) => {
    const planned = plannedWaypoint(answer, index);
    if (!planned || attach.length + detach.length === 0) return;
    const joints = jointMatrices(robot, planned.position);
    for (const id of detach) now = now.map((one) => (one.id === id ? moved(one, null, joints) : one));
    for (const { id, link } of attach) {
      const holder = robot.placements.find(({ frame }) => frame === (link ?? robot.tip_frame));
      if (holder) now = now.map((one) => (one.id === id ? moved(stoppedAt(one, planned.arrival_time), holder.after, joints) : one));
    }
    stretches.push({ from: planned.arrival_time, placed: now });
  });
  return stretches;
}

// A moving object where it is at a time, from then on without a motion of its own.
function stoppedAt({ at, ...one }: Placed, time: number): Placed {
  return at ? { ...one, matrix: at(time) } : one;
}

// The same thing at the same place, from here on behind other joints, or standing still.
function moved(one: Placed, after: number | null, joints: readonly Matrix4[]): Placed {
  const inBase = one.after === null ? one.matrix : joints[one.after]!.clone().multiply(one.matrix);
  return { ...one, after, matrix: after === null ? inBase : joints[after]!.clone().invert().multiply(inBase) };
}

// Where things are at a time, s; the same array until something is taken or put down, unless there are moving objects.
export function placedAt(stretches: readonly Stretch[], time: number): readonly Placed[] {
  const placed = stretches.findLast(({ from }) => from <= time)?.placed ?? [];
  return placed.some(({ at }) => at) ? placed.map((one) => (one.at ? { ...one, matrix: one.at(time) } : one)) : placed;
}
