// Clearances that are proved for estimated shapes of the links: the machine may be nearer.
import type { Clearance, PlanAnswer } from '../service/types';
import { texts } from '../texts';
import { lengthAbove } from './units';

// What is said of a clearance; null: its shapes are those of the robot's model.
export function estimateOf({ shapes, uncertainty, lower }: Clearance): string | null {
  if (shapes !== 'estimate') return null;
  return texts.clearance.estimate(lengthAbove(uncertainty), lower >= uncertainty);
}

// The estimate of a plan that leaves least room.
export function estimateOfPlan({ certificate }: PlanAnswer): string | null {
  const { scene, itself, contacts } = certificate.clearance ?? {};
  const estimates = [scene, itself, contacts].filter((one) => one?.shapes === 'estimate') as Clearance[];
  const least = estimates.sort((a, b) => a.lower - a.uncertainty - (b.lower - b.uncertainty))[0];
  return least ? estimateOf(least) : null;
}
