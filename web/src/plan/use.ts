// How much of its limits a motion uses at each sample.
import type { PlanRequest, PlanAnswer, Robot } from '../service/types';
import { bandOf } from './limits';
import type { Band } from './limits';

const RATES = ['velocity', 'acceleration', 'jerk', 'torque'] as const;

// The largest share of a limit that any joint uses at each sample: 1 is all of it. What the back end does not promise to
// keep is left out.
export function limitUse(answer: PlanAnswer, request: PlanRequest, robot: Robot): number[] {
  const promised = new Set(answer.certificate.checks.filter(({ enforced }) => enforced).map(({ quantity }) => quantity));
  const { samples } = answer;
  const most = samples.time.map(() => 0);
  for (const quantity of RATES) {
    const rows = samples[quantity];
    if (!rows || !promised.has(quantity)) continue;
    const bands = answer.waypoints.slice(1).map(({ index }) => robot.joints.map((_, joint) => bandOf(robot, request, quantity, joint, index)));
    rows.forEach((row, i) => {
      const ofSegment = bands[samples.segment[i]!]!;
      row.forEach((value, joint) => (most[i] = Math.max(most[i]!, usedOf(value, ofSegment[joint]!))));
    });
  }
  return most;
}

function usedOf(value: number, { lower, upper }: Band): number {
  const limit = value < 0 ? lower : upper;
  return limit === null || limit === 0 ? 0 : value / limit;
}
