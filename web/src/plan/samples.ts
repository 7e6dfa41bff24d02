// Reading a trajectory between its samples.
import type { PlanAnswer, PlannedWaypoint } from '../service/types';

// The last index whose time is not after `time`, and the share of the interval that lies before it.
export function locate(times: readonly number[], time: number): [number, number] {
  let [low, high] = [0, times.length - 1];
  if (time >= times[high]!) return [Math.max(0, high - 1), high > 0 ? 1 : 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= time) low = middle;
    else high = middle;
  }
  return [low, Math.max(0, (time - times[low]!) / (times[high]! - times[low]!))];
}

// The joint positions at a time, straight between samples.
export function positionAt({ samples }: PlanAnswer, time: number): number[] {
  const [index, share] = locate(samples.time, time);
  const before = samples.position[index]!;
  const after = samples.position[index + 1] ?? before;
  return before.map((value, joint) => value + share * (after[joint]! - value));
}

// The speed of the tool at each sample, m/s.
export function toolSpeeds({ samples }: PlanAnswer): number[] {
  return samples.tcp_velocity?.linear.map((row) => Math.hypot(...row)) ?? [];
}

// A waypoint of the request, as it was planned: of a way around with corners, the last of its points.
export function plannedWaypoint({ waypoints }: PlanAnswer, index: number): PlannedWaypoint | undefined {
  return waypoints.findLast((waypoint) => waypoint.index === index);
}
