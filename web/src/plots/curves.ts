// What a plot shows: curves and their limits over time, in the units of people or as shares of the limits.
import { toolSpeeds } from '../plan/samples';
import { shownIn, unitOf } from '../plan/units';
import type { Quantity } from '../plan/units';
import { bandsOf } from '../plan/use';
import type { Band } from '../plan/use';
import { slowTimes } from '../plan/zones';
import type { Slow } from '../plan/zones';
import type { Joint, Robot } from '../service/types';
import type { Planned } from '../state/store';
import { jointColour } from './colours';

export type Plotted = Quantity | 'tool_speed';

export interface Curve {
  label: string;
  colour: string;
  values: (number | null)[];
  bands: Band[]; // one a sample, in the units of the values
}

export interface Curves {
  time: number[];
  segment: number[]; // of each sample
  unit: string;
  curves: Curve[];
  slow: Slow[]; // limits near objects, in the units of the values
}

// Returns null where the plan has no such quantity.
export function curvesOf(planned: Planned, robot: Robot, quantity: Plotted, focus: number | null, relative: boolean): Curves | null {
  const { answer } = planned;
  const { time, segment } = answer.samples;
  if (quantity === 'tool_speed') {
    const { factor, name: unit } = shownIn('m/s');
    const limits = answer.limits?.tool['tcp_linear_velocity']?.map((upper): Band => scaled({ lower: null, upper }, factor));
    const bands = segment.map((own): Band => limits?.[own] ?? { lower: null, upper: null });
    return {
      time,
      segment,
      unit,
      curves: [{ label: 'tool', colour: jointColour(0), values: toolSpeeds(answer).map((speed) => speed * factor), bands }],
      slow: slowTimes(answer).map((near) => ({ ...near, limit: near.limit * factor })),
    };
  }
  const rows = answer.samples[quantity];
  if (!rows) return null;
  const joints = robot.joints.map((_, joint) => joint).filter((joint) => focus === null || joint === focus);
  const curves = joints.map((joint): Curve => {
    const described = robot.joints[joint]!;
    const { factor } = shownIn(unitOf(described, quantity));
    const bands = bandsOf(answer, quantity, joint);
    const values = relative ? rows.map((row, i) => shareOf(row[joint]!, bands[i]!)) : rows.map((row) => row[joint]! * factor);
    return {
      label: described.name,
      colour: jointColour(joint),
      values,
      bands: relative ? bands.map(() => ({ lower: -100, upper: 100 })) : bands.map((band) => scaled(band, factor)),
    };
  });
  return {
    time,
    segment,
    unit: relative
      ? '%'
      : unitsOf(
          joints.map((j) => robot.joints[j]!),
          quantity,
        ),
    curves,
    slow: [],
  };
}

// The percentage of a band that is used: -100 at its lower end, 100 at its upper; null: it has no end.
export function shareOf(value: number, { lower, upper }: Band): number | null {
  if (lower === null || upper === null) return null;
  if (lower < 0 && upper > 0 && Math.abs(lower + upper) < 1e-9 * upper) return (100 * value) / upper;
  return 100 * ((2 * (value - lower)) / (upper - lower) - 1);
}

function scaled({ lower, upper }: Band, factor: number): Band {
  return { lower: lower === null ? null : lower * factor, upper: upper === null ? null : upper * factor };
}

function unitsOf(joints: readonly Joint[], quantity: Quantity): string {
  return [...new Set(joints.map((joint) => shownIn(unitOf(joint, quantity)).name))].join(', ');
}

// Tells whether all curves have the same limits.
export function shareLimits([first, ...others]: readonly Curve[]): boolean {
  return others.every(({ bands }) =>
    bands.every(({ lower, upper }, i) => lower === first!.bands[i]!.lower && upper === first!.bands[i]!.upper),
  );
}

const ROOM = 1.6; // a limit is shown when the axis gets no more than this many times taller

// The range of the axis: the curves with a margin, and the limits that are near.
export function axisRange(curves: readonly Curve[], slow: readonly Slow[] = []): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const { values } of curves) {
    for (const value of values) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return [-1, 1];
  const span = Math.max(high - low, 1e-9, 0.02 * Math.max(Math.abs(low), Math.abs(high)));
  const [bottom, top] = [low, high];
  const limits = curves.flatMap(({ bands }) => bands.flatMap(({ lower, upper }) => [lower, upper]));
  for (const limit of [...limits, ...slow.map((near) => near.limit)]) {
    if (limit === null) continue;
    if (Math.max(top, limit) - Math.min(bottom, limit) <= ROOM * span) [low, high] = [Math.min(low, limit), Math.max(high, limit)];
  }
  return [low - 0.07 * span, high + 0.07 * span];
}
