// The quantities of the certificate: their titles and units, from the planner's own table (npm run types).
import measures from '../service/quantities.json';
import type { Joint } from '../service/types';
import { texts } from '../texts';
import { degrees } from './units';

interface Measure {
  title: string;
  unit: string;
  unit_of_sliding: string | null; // at a joint that slides; null: `unit`
}

const MEASURES: Readonly<Record<string, Measure>> = measures;

export function titleOf(quantity: string): string {
  return texts.measures[quantity] ?? MEASURES[quantity]?.title ?? quantity.replaceAll('_', ' ');
}

// The unit in which people read a quantity, and how many of it the service's unit is: at joints, and of errors and
// deviations of the tool, they read ° and mm.
export function shownUnit(quantity: string, joint: Joint | undefined): [number, string] {
  const measure = MEASURES[quantity];
  const unit = (joint?.kind === 'prismatic' ? measure?.unit_of_sliding : null) ?? measure?.unit ?? '';
  const isLengthOrAngle = unit === 'm' || unit === 'rad';
  if ((joint || isLengthOrAngle) && unit.startsWith('rad')) return [degrees(1), unit.replace('rad', '°')];
  if ((joint || isLengthOrAngle) && /^m(\/|$)/.test(unit)) return [1000, unit.replace('m', 'mm')];
  return [1, unit];
}
