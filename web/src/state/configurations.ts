// The ways in which the chosen pose can be reached, asked of the service when somebody wants to choose among them.
import { computed, signal } from '@preact/signals';
import { plannedWaypoint } from '../plan/samples';
import type { PlanRequest, Pose, Solution } from '../service/types';
import { waysTo } from './inverse';
import { isStale, problem, request, robot, selected, shownPlan } from './store';

const found = signal<{ request: PlanRequest; index: number; solutions: readonly Solution[] } | null>(null);

// Those of the waypoint that is chosen, as it is now; null: they have not been asked for.
export const solutions = computed(() =>
  found.value?.request === request.value && found.value.index === selected.value ? found.value.solutions : null,
);

// Where the arm stands at the chosen waypoint as it is planned; null: it is not.
export const plannedPosition = computed(() => {
  const planned = isStale.value || !shownPlan.value ? undefined : plannedWaypoint(shownPlan.value.answer, selected.value);
  return planned?.position ?? null;
});

// The pose of a waypoint in the base frame; null: only a plan of the request as it is now could tell.
export function poseInBase(asked: PlanRequest, index: number): Pose | null {
  const planned = isStale.value || !shownPlan.value ? undefined : plannedWaypoint(shownPlan.value.answer, index);
  const waypoint = asked.waypoints[index];
  if (planned) return planned.pose;
  return waypoint?.kind === 'pose' && !waypoint.frame && !waypoint.on ? waypoint.pose : null;
}

export async function askSolutions(): Promise<void> {
  const [asked, index] = [request.value, selected.value];
  const pose = asked && poseInBase(asked, index);
  if (!pose || robot.value?.id !== asked.robot) return;
  const { answer, problem: refused } = await waysTo(pose, asked, index, robot.value, plannedPosition.value ?? undefined);
  if (request.value !== asked) return;
  if (answer) found.value = { request: asked, index, solutions: answer.solutions };
  else problem.value = refused;
}
