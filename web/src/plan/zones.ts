// When the robot is in which of its speed zones.
import type { PlanAnswer } from '../service/types';

export interface Slow {
  from: number; // s
  to: number; // s
  limit: number; // m/s, of every point of the robot
}

// The times at which the robot counts as near to objects, with the speed that is allowed then: the least where zones overlap.
export function slowTimes({ certificate }: PlanAnswer): Slow[] {
  const zones = certificate.speed_zones ?? [];
  const all = zones.flatMap(({ intervals, limit }) => intervals.map(([from, to]): Slow => ({ from: from!, to: to!, limit })));
  const ends = [...new Set(all.flatMap(({ from, to }) => [from, to]))].sort((a, b) => a - b);
  return ends.slice(1).flatMap((to, i) => {
    const from = ends[i]!;
    const limits = all.filter((zone) => zone.from <= from && to <= zone.to).map(({ limit }) => limit);
    return limits.length > 0 ? [{ from, to, limit: Math.min(...limits) }] : [];
  });
}
