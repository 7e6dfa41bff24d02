// The units of lengths and angles that a person has chosen, kept in the browser. Requests stay in m and rad.
import { signal } from '@preact/signals';

// How many of it one m or one rad is, how many decimals a person reads, and the steps of a hand.
export interface Scale {
  factor: number;
  decimals: number;
  steps: readonly [number, number, number, number];
}

export const LENGTHS = {
  mm: { factor: 1000, decimals: 1, steps: [0.1, 1, 10, 50] },
  m: { factor: 1, decimals: 4, steps: [0.0001, 0.001, 0.01, 0.05] },
  in: { factor: 1 / 0.0254, decimals: 3, steps: [0.01, 0.1, 0.5, 2] },
} as const satisfies Record<string, Scale>;

export const ANGLES = {
  '°': { factor: 180 / Math.PI, decimals: 1, steps: [0.1, 1, 5, 15] },
  rad: { factor: 1, decimals: 3, steps: [0.001, 0.01, 0.1, 0.25] },
} as const satisfies Record<string, Scale>;

export type Length = keyof typeof LENGTHS;
export type Angle = keyof typeof ANGLES;

const [LENGTH_KEY, ANGLE_KEY] = ['length unit', 'angle unit'];

export const lengthUnit = signal<Length>(kept(LENGTH_KEY, LENGTHS, 'mm'));
export const angleUnit = signal<Angle>(kept(ANGLE_KEY, ANGLES, '°'));

function kept<T extends string>(key: string, known: Readonly<Record<T, Scale>>, usual: T): T {
  const found = typeof localStorage === 'undefined' ? null : localStorage.getItem(key);
  return found !== null && Object.hasOwn(known, found) ? (found as T) : usual;
}

export function chooseLength(unit: Length): void {
  localStorage.setItem(LENGTH_KEY, unit);
  lengthUnit.value = unit;
}

export function chooseAngle(unit: Angle): void {
  localStorage.setItem(ANGLE_KEY, unit);
  angleUnit.value = unit;
}
