// The quantities of the certificate: their titles and units, from the planner's own table (npm run types).
import measures from '../service/quantities.json';
import type { Joint } from '../service/types';
import { texts } from '../texts';

interface Measure {
  title: string;
  unit: string;
  unit_of_sliding: string | null; // at a joint that slides; null: `unit`
}

const MEASURES: Readonly<Record<string, Measure>> = measures;

export function titleOf(quantity: string): string {
  return texts.measures[quantity] ?? MEASURES[quantity]?.title ?? quantity.replaceAll('_', ' ');
}

// The service's unit of a quantity, of a joint or of the tool.
export function unitOfQuantity(quantity: string, joint: Joint | undefined): string {
  const measure = MEASURES[quantity];
  return (joint?.kind === 'prismatic' ? measure?.unit_of_sliding : null) ?? measure?.unit ?? '';
}
