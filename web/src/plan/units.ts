// People read degrees and millimetres; the service speaks rad and m.
import type { Joint } from '../service/types';

export type Quantity = 'position' | 'velocity' | 'acceleration' | 'jerk' | 'torque';

const DEGREES = 180 / Math.PI;
const POWERS: Record<Quantity, string> = { position: '', velocity: '/s', acceleration: '/s²', jerk: '/s³', torque: '' };

export function factorOf(joint: Joint, quantity: Quantity): number {
  if (quantity === 'torque') return 1;
  return joint.kind === 'prismatic' ? 1000 : DEGREES;
}

export function unitOf(joint: Joint, quantity: Quantity): string {
  if (quantity === 'torque') return joint.kind === 'prismatic' ? 'N' : 'N m';
  return (joint.kind === 'prismatic' ? 'mm' : '°') + POWERS[quantity];
}

export function degrees(radians: number): number {
  return radians * DEGREES;
}

export function radians(degrees: number): number {
  return degrees / DEGREES;
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

// With one decimal, and no sign before 0.0.
export function tenths(value: number): string {
  return (Math.round(value * 10) / 10 + 0).toFixed(1);
}

export function seconds(value: number): string {
  return `${value.toFixed(value < 10 ? 3 : 2)} s`;
}

// A length in m as mm, rounded down: so far it is proved.
export function millimetres(value: number): string {
  return `${Math.floor(value * 1e4 + 1e-6) / 10} mm`;
}

// A length in m as mm, rounded up: so much covers it.
export function millimetresAbove(value: number): string {
  return `${Math.ceil(value * 1e4 - 1e-6) / 10} mm`;
}

// How much nearer two things are than they may be, as mm.
export function depthOf({ depth }: { depth: number }): string {
  return `${short(depth * 1000, 3)} mm`;
}

// In another unit; nothing stays nothing.
export function scaled(value: number | null | undefined, factor: number): number | undefined {
  return typeof value === 'number' ? value * factor : undefined;
}
