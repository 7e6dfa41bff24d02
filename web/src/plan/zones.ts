// When the robot is in which of its speed zones.
import type { PlanAnswer, SpeedZoneAnswer } from '../service/types';
import { texts } from '../texts';

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

export interface ZoneNotes {
  about: string; // which objects, and when the robot is near them
  fastest: string | null; // the link of the fastest point
  exceeded: string | null; // when the speed may be too high
}

// What is said of a zone of the certificate besides its figures.
export function zoneNotes({ objects, intervals, link, exceeded }: SpeedZoneAnswer): ZoneNotes {
  const near = intervals.length > 0 ? texts.zones.during(times(intervals)) : texts.zones.never;
  return {
    about: `${texts.zones.about(objects)}, ${near}`,
    fastest: link === null ? null : texts.zones.fastest(link),
    exceeded: exceeded.length > 0 ? texts.zones.exceeded(times(exceeded)) : null,
  };
}

function times(intervals: readonly (readonly number[])[]): string[] {
  return intervals.map(([from, to]) => texts.zones.interval(from!.toFixed(2), to!.toFixed(2)));
}
