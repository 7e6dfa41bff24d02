// The motions that a waypoint may be reached by.
import type { FreeMotion, Motion, Pose } from '../service/types';
import { withoutEmpty } from './edits';

type Objective = NonNullable<FreeMotion['optimise']>;

export const MOTIONS = ['joint', 'linear', 'circular', 'polyline', 'spline', 'free'] as const;
const FIRST_BLEND = 0.01; // m

// A joint motion is what the service takes where none is asked. Others lead past a pose.
export function motionOf(kind: Motion['kind'], past: Pose): object | undefined {
  switch (kind) {
    case 'joint':
      return undefined;
    case 'circular':
      return { kind, via: past };
    case 'polyline':
      return { kind, poses: [past], blend: FIRST_BLEND };
    case 'spline':
      return { kind, poses: [past] };
    default:
      return { kind };
  }
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
