// Speed zones of a request: each edit returns a new request.
import type { PlanRequest, SpeedZone } from '../service/types';
import { withoutEmpty } from './edits';

const FIRST: SpeedZone = { clearance: 0.3, speed: 0.25 };

export function zonesOf({ speed_zones }: PlanRequest): readonly SpeedZone[] {
  return speed_zones ?? [];
}

export function withZones(request: PlanRequest, zones: readonly SpeedZone[]): PlanRequest {
  return withoutEmpty({ ...request, speed_zones: zones.length > 0 ? [...zones] : undefined });
}

// Another zone about the objects of the last one, half as wide and half as fast, since zones make steps.
export function withAnotherZone(request: PlanRequest): PlanRequest {
  const zones = zonesOf(request);
  const last = zones.at(-1);
  return withZones(request, [...zones, last ? { ...last, clearance: last.clearance / 2, speed: last.speed / 2 } : FIRST]);
}

export function withZone(request: PlanRequest, index: number, changes: Partial<SpeedZone>): PlanRequest {
  return withZones(
    request,
    zonesOf(request).map((zone, i) => (i === index ? { ...zone, ...changes } : zone)),
  );
}

export function withoutZone(request: PlanRequest, index: number): PlanRequest {
  return withZones(
    request,
    zonesOf(request).filter((_, i) => i !== index),
  );
}

// A zone about one object more or less; about none, it is about all that stand still.
export function aboutObject({ objects, ...zone }: SpeedZone, id: string, isIn: boolean): SpeedZone {
  const next = isIn ? [...(objects ?? []), id] : (objects ?? []).filter((other) => other !== id);
  return next.length > 0 ? { ...zone, objects: next } : zone;
}
