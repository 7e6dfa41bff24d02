// Which tool is in force: a waypoint may bring one, which holds on the motion to it and from there on.
import type { PlanAnswer, PlanRequest, Pose } from '../service/types';
import { locate } from './samples';

// The tool at a waypoint of the request; null: it is the robot's own.
export function toolAt({ waypoints, tool }: PlanRequest, index: number): Pose | null {
  return waypoints.slice(0, index + 1).findLast((waypoint) => waypoint.tool)?.tool ?? tool ?? null;
}

// The tool at a time of the plan.
export function toolAtTime(request: PlanRequest, answer: PlanAnswer, time: number): Pose | null {
  return toolOfSegment(request, answer, answer.samples.segment[locate(answer.samples.time, time)[0]]!);
}

function toolOfSegment(request: PlanRequest, { waypoints }: PlanAnswer, segment: number): Pose | null {
  return toolAt(request, waypoints[segment + 1]!.index);
}

// The samples from one change of the tool to the next, each as its first and the one behind its last: at a change the
// tool centre point is at once elsewhere, and no path leads there.
export function stretchesOfTools(request: PlanRequest, answer: PlanAnswer): [number, number][] {
  const tools = answer.waypoints.slice(1).map((_, segment) => JSON.stringify(toolOfSegment(request, answer, segment)));
  const { segment } = answer.samples;
  const changes = segment.flatMap((now, i) => (i > 0 && tools[now] !== tools[segment[i - 1]!] ? [i] : []));
  const stretches = [0, ...changes].map((from, i): [number, number] => [from, changes[i] ?? segment.length]);
  return stretches.filter(([from, to]) => to - from > 1);
}
