// The motions that a waypoint may be reached by.
import type { FreeMotion, Motion, PlanRequest } from '../service/types';
import { withoutEmpty } from './edits';

type Objective = NonNullable<FreeMotion['optimise']>;

// Joint and linear motions are chosen on the page, free ones where something may be in the way; another kind stays as it is
// until one of these is chosen.
export function motionsOf({ waypoints, scene, self_collision }: PlanRequest, index: number): Motion['kind'][] {
  const mayMeet = Boolean(scene ?? self_collision);
  return [
    ...new Set<Motion['kind']>(['joint', 'linear', ...(mayMeet ? (['free'] as const) : []), waypoints[index]?.motion?.kind ?? 'joint']),
  ];
}

// A joint motion is what the service takes where none is asked.
export function motionOf(kind: Motion['kind']): object | undefined {
  return kind === 'joint' ? undefined : { kind };
}

// The first way that is found will do, or it is made better by something; what bounds the effort for that goes with it.
export function optimised(motion: FreeMotion, optimise: Objective | null): FreeMotion {
  if (optimise !== null) return { ...motion, optimise };
  return withoutEmpty({ ...motion, optimise: undefined, time_budget: undefined, optimise_checks: undefined });
}

// Undefined: as many motions are looked at as the service does by itself.
export function budgeted(motion: FreeMotion, time_budget: number | undefined): FreeMotion {
  return withoutEmpty({ ...motion, time_budget });
}
