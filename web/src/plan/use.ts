// The limits in force, as the answer states them, and how much of them a motion uses at each sample.
import type { PlanAnswer } from '../service/types';
import type { Quantity } from './units';

const RATES = ['velocity', 'acceleration', 'jerk', 'torque'] as const;

export interface Band {
  lower: number | null;
  upper: number | null;
}

// The limits of a joint at each sample; null: no limit on that side. Samples of one segment share one band, unless the
// limits depend on the state of the robot.
export function bandsOf({ limits, samples }: PlanAnswer, quantity: Quantity, joint: number): Band[] {
  const atSamples = limits?.at_samples?.[quantity];
  if (atSamples)
    return samples.time.map((_, i) => ({ lower: atSamples.lower[i]![joint] ?? null, upper: atSamples.upper[i]![joint] ?? null }));
  const none: Band = { lower: null, upper: null };
  const [lower, upper] = [limits?.[quantity].lower ?? [], limits?.[quantity].upper ?? []];
  const bands = lower.map((row, segment): Band => ({ lower: row[joint] ?? null, upper: upper[segment]![joint] ?? null }));
  return samples.segment.map((segment) => bands[segment] ?? none);
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
    for (let joint = 0; joint < rows[0]!.length; joint++) {
      bandsOf(answer, quantity, joint).forEach((band, i) => (most[i] = Math.max(most[i]!, usedOf(rows[i]![joint]!, band))));
    }
  }
  return most;
}

function usedOf(value: number, { lower, upper }: Band): number {
  const limit = value < 0 ? lower : upper;
  return limit === null || limit === 0 ? 0 : value / limit;
}
