// A pose half way to a waypoint and beside the straight line, which a circle, a polyline or a spline begins with.
import { plannedWaypoint } from '../plan/samples';
import { poseInFrame } from '../request/frames';
import type { PlanRequest, Pose, Robot } from '../service/types';
import { shownPlan } from './store';

const ASIDE = 0.2; // of the distance

// In the frame of the waypoint, from the last plan; without one it is the origin.
export function halfWay(request: PlanRequest, robot: Robot, index: number): Pose {
  const planned = shownPlan.value?.answer;
  const [from, to] = [index - 1, index].map((one) => planned && plannedWaypoint(planned, one)?.pose.position);
  if (!from || !to) return { position: [0, 0, 0] };
  const distance = Math.hypot(...to.map((value, i) => value - from[i]!));
  const position = to.map((value, i) => Number(((value + from[i]!) / 2 + (i === 2 ? ASIDE * distance : 0)).toFixed(6)));
  const waypoint = request.waypoints[index]!;
  return poseInFrame({ position }, waypoint.kind === 'pose' ? waypoint.frame : null, request, robot);
}
