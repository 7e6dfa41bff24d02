// Which of its configurations a pose is reached in.
import type { PlanRequest, Solution } from '../service/types';
import { jointWaypoint, withWaypoint } from './edits';

const PARTS = ['shoulder', 'elbow', 'wrist'] as const;

// The sides of shoulder, elbow and wrist that have a name.
export function sidesOf({ configuration }: Solution): [string, string][] {
  return PARTS.flatMap((part): [string, string][] => (configuration[part] === null ? [] : [[part, configuration[part]]]));
}

// Asks for one of the solutions of a pose: by the names of its configuration if no other one has them, else by its joint
// position.
export function configured(request: PlanRequest, index: number, solution: Solution, all: readonly Solution[]): PlanRequest {
  const sides = sidesOf(solution);
  const fitting = all.filter(({ configuration }) =>
    sides.every(([part, side]) => [side, null].includes(configuration[part as (typeof PARTS)[number]])),
  );
  if (sides.length > 0 && fitting.length === 1) return withWaypoint(request, index, { configuration: Object.fromEntries(sides) });
  const ofPoses = { pose: undefined, on: undefined, frame: undefined, free: undefined, configuration: undefined, external: undefined };
  return withWaypoint(request, index, { ...ofPoses, ...jointWaypoint(solution.position) });
}

// Leaves the configuration to the planner.
export function unconfigured(request: PlanRequest, index: number): PlanRequest {
  return withWaypoint(request, index, { configuration: undefined });
}

const SAME = 1e-3; // rad or m

// Whether the arm stands in one of the ways: not a whole turn away, either.
export function isSolution(position: readonly number[], solution: Solution): boolean {
  return solution.position.every((value, joint) => Math.abs(value - position[joint]!) < SAME);
}
