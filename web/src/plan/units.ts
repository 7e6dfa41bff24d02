// Numbers as people read them: lengths and angles in the units that they chose. The service speaks m and rad.
import type { Joint } from '../service/types';
import { ANGLES, angleUnit, LENGTHS, lengthUnit } from '../state/units';
import type { Scale } from '../state/units';

export type Quantity = 'position' | 'velocity' | 'acceleration' | 'jerk' | 'torque';

const POWERS: Record<Quantity, string> = { position: '', velocity: '/s', acceleration: '/s^2', jerk: '/s^3', torque: '' };

// The service's unit of a quantity of a joint.
export function unitOf({ kind }: Joint, quantity: Quantity): string {
  if (quantity === 'torque') return kind === 'prismatic' ? 'N' : 'N m';
  return (kind === 'prismatic' ? 'm' : 'rad') + POWERS[quantity];
}

export interface Shown extends Pick<Scale, 'factor' | 'decimals'> {
  name: string;
}

// How people read numbers of a unit of the service, such as m or rad/s^2; a share, %, is one of 100.
export function shownIn(unit: string): Shown {
  const name = unit.replace('^2', '²').replace('^3', '³');
  if (/^rad(\/|$)/.test(unit)) return { ...ANGLES[angleUnit.value], name: name.replace('rad', angleUnit.value) };
  if (/^m(\/|$)/.test(unit)) return { ...LENGTHS[lengthUnit.value], name: name.replace('m', lengthUnit.value) };
  return { factor: unit === '%' ? 100 : 1, decimals: 1, name };
}

// The name of a field or a column with the unit of its numbers.
export function withUnit(label: string, unit: string): string {
  const { name } = shownIn(unit);
  return label && name ? `${label} (${name})` : label || name;
}

// What a person has written, in the service's unit, without the last digits of the conversion.
export function inService(value: number, unit: string): number {
  const { factor } = shownIn(unit);
  return factor === 1 ? value : Number((value / factor).toPrecision(12));
}

// A number of the service with its unit, with so many significant digits.
export function written(value: number, unit: string, digits = 4): string {
  const { factor, name } = shownIn(unit);
  return `${short(value * factor, digits)} ${name}`;
}

// With as many decimals as a person reads, and no sign before 0.0.
export function decimal(value: number, unit: string): string {
  const { factor, decimals } = shownIn(unit);
  return (Number((value * factor).toFixed(decimals)) + 0).toFixed(decimals);
}

const SMALLEST_DECIMAL = 1e-3; // smaller numbers, and numbers from LARGEST_DECIMAL on, have a power of ten
const LARGEST_DECIMAL = 1e9;
const SUPERSCRIPTS = '⁰¹²³⁴⁵⁶⁷⁸⁹';

// A number with so many significant digits, without zeros at the end: 0.25, 5.73×10⁻⁵.
export function short(value: number, digits = 4): string {
  const size = Math.abs(value);
  if (value === 0 || (size >= SMALLEST_DECIMAL && size < LARGEST_DECIMAL)) return String(Number(value.toPrecision(digits)));
  const [factor, power] = value.toExponential(digits - 1).split('e');
  const raised = power!
    .replace('+', '')
    .replace('-', '⁻')
    .replace(/\d/g, (digit) => SUPERSCRIPTS[Number(digit)]!);
  return `${Number(factor)}×10${raised}`;
}

export function seconds(value: number): string {
  return `${value.toFixed(value < 10 ? 3 : 2)} s`;
}

// A length rounded down: so far it is proved.
export function lengthBelow(value: number): string {
  return roundedLength(value, (scaled) => Math.floor(scaled + 1e-6));
}

// A length rounded up: so much covers it.
export function lengthAbove(value: number): string {
  return roundedLength(value, (scaled) => Math.ceil(scaled - 1e-6));
}

function roundedLength(value: number, round: (scaled: number) => number): string {
  const { factor, decimals, name } = shownIn('m');
  return `${round(value * factor * 10 ** decimals) / 10 ** decimals} ${name}`;
}

// How much nearer two things are than they may be.
export function depthOf({ depth }: { depth: number }): string {
  return written(depth, 'm', 3);
}
