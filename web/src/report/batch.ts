// What the report of a batch holds (api/work/tasks/batch_reports.py), and how its figures are written.
import { signal } from '@preact/signals';
import { short } from '../plan/units';
import type { Bars } from '../panels/Histogram';
import type { Batch } from '../service/types';
import type { Arm, AskedPlan } from '../state/reported';

export interface Answered {
  position: number;
  outcome: string;
  duration: number | null; // s
  ratio: number | null;
  seconds: number | null; // of a worker
}

export type Kind = 'longest' | 'nearest' | 'slowest';
export const KINDS: readonly Kind[] = ['longest', 'nearest', 'slowest'];

export interface Figures {
  duration: Bars | null;
  ratio: Bars | null;
  seconds: Bars | null;
  worst: Record<Kind, readonly Answered[]>;
  examples: Record<string, readonly Answered[]>;
}

export interface ShownPlan {
  plan: AskedPlan;
  arm: number; // among those of the report
}

export interface ReportedBatch {
  batch: Batch;
  figures: Figures;
  plans: Record<string, ShownPlan>; // by the index of their requests
  problems: Record<string, string>;
  arms: readonly Arm[];
  version: string;
}

// The index of the request whose plan is shown.
export const chosen = signal<number | null>(null);

export function choose(index: number | null): void {
  chosen.value = index;
}

// The first of the worst that there is a plan of to be shown.
export function firstShown({ figures, plans }: ReportedBatch): number | null {
  const listed = KINDS.flatMap((kind) => figures.worst[kind]);
  return listed.find(({ position }) => position in plans)?.position ?? null;
}

// A time that may be very short, in ms or s.
export function span(seconds: number): string {
  return seconds < 1 ? `${short(seconds * 1000, 3)} ms` : `${short(seconds, 3)} s`;
}

// A share as a percentage, never rounded up to all.
export function percent(share: number): string {
  const written = short(100 * share, share < 0.995 ? 3 : 4);
  return `${share < 1 && written === '100' ? '99.99' : written} %`;
}
