// The limits in force, as the answer states them, and how much of them a motion uses at each sample.
import type { PlanAnswer } from '../service/types';
import type { Quantity } from './units';

const RATES = ['velocity', 'acceleration', 'jerk', 'torque'] as const;

export interface Band {
  lower: number | null;
  upper: number | null;
}

// The limits of a joint on a segment; null: no limit on that side.
export function bandOf({ limits }: PlanAnswer, quantity: Quantity, joint: number, segment: number): Band {
  return { lower: limits?.[quantity].lower[segment]?.[joint] ?? null, upper: limits?.[quantity].upper[segment]?.[joint] ?? null };
}

// The largest share of a limit that any joint uses at each sample: 1 is all of it. What the back end does not promise to
// keep is left out.
export function limitUse(answer: PlanAnswer): number[] {
  const promised = new Set(answer.certificate.checks.filter(({ enforced }) => enforced).map(({ quantity }) => quantity));
  const { samples } = answer;
  const most = samples.time.map(() => 0);
  for (const quantity of RATES) {
    const rows = samples[quantity];
    if (!rows || !promised.has(quantity)) continue;
    rows.forEach((row, i) => {
      row.forEach((value, joint) => (most[i] = Math.max(most[i]!, usedOf(value, bandOf(answer, quantity, joint, samples.segment[i]!)))));
    });
  }
  return most;
}

function usedOf(value: number, { lower, upper }: Band): number {
  const limit = value < 0 ? lower : upper;
  return limit === null || limit === 0 ? 0 : value / limit;
}
