// When the robot is at a waypoint, as it is planned: a pose on a moving object is where the object is then.
import { plannedWaypoint } from '../plan/samples';
import { shownPlan } from './store';

// The time of arrival, s; 0 without a plan.
export function metAt(index: number): number {
  return (shownPlan.value && plannedWaypoint(shownPlan.value.answer, index)?.arrival_time) ?? 0;
}
