// Where the tool is at both ends of the motion to a waypoint, and what it keeps on the way.
import { computed } from '@preact/signals';
import { plannedWaypoint } from '../plan/samples';
import { toolAt } from '../plan/tools';
import { poseInBase } from '../request/places';
import { toolPose } from '../robot/tool_pose';
import type { PlanRequest, Pose, PoseConstraint, Robot } from '../service/types';
import { metAt } from './meeting';
import { request, robot, selected, shownPlan } from './store';

// In the base frame, from the request where it says so, else from the last plan; what neither says is left out.
export function endsOf(shown: PlanRequest, arm: Robot, index: number): Pose[] {
  return [index - 1, index].flatMap((one) => poseAt(shown, arm, one) ?? []);
}

function poseAt(shown: PlanRequest, arm: Robot, index: number): Pose | null {
  const waypoint = shown.waypoints[index];
  if (waypoint?.kind === 'joint' && waypoint.position.length === arm.joints.length)
    return toolPose(arm, waypoint.position, toolAt(shown, index));
  const wanted = waypoint?.kind === 'pose' ? poseInBase(waypoint, shown, arm, metAt(index)) : null;
  if (wanted?.orientation) return wanted;
  return (shownPlan.value && plannedWaypoint(shownPlan.value.answer, index)?.pose) ?? wanted;
}

export interface Kept {
  constraints: readonly PoseConstraint[];
  ends: readonly Pose[];
}

// What the tool keeps on the way to the chosen waypoint; null: nothing.
export const kept = computed<Kept | null>(() => {
  const [shown, arm] = [request.value, robot.value];
  const motion = shown?.waypoints[selected.value]?.motion;
  if (!shown || arm?.id !== shown.robot || motion?.kind !== 'free' || !motion.keep?.length) return null;
  return { constraints: motion.keep, ends: endsOf(shown, arm, selected.value) };
});
