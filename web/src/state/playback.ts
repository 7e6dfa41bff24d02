// The time that is shown, and its course while the motion is played.
import { effect, signal } from '@preact/signals';
import { plannedWaypoint } from '../plan/samples';
import { isStale, selected, shownPlan } from './store';
import type { Planned } from './store';

export const time = signal(0);
export const playing = signal(false);
export const isAnchored = signal(false); // the time stays at the chosen waypoint when there is another plan
export const speed = signal(1);
export const SPEEDS: readonly number[] = [0.1, 0.25, 0.5, 1, 2, 4];

let last = 0;

// How long all move: of a cell, until the last robot has ended.
export function durationOf(shown: Planned | null): number {
  return shown?.cell?.duration ?? shown?.answer.duration ?? 0;
}

export function duration(): number {
  return durationOf(shownPlan.value);
}

export function seek(to: number): void {
  isAnchored.value = false;
  time.value = Math.min(Math.max(0, to), duration());
}

// Shows the arrival at a waypoint, which only a plan of the request as it is now can tell.
export function goTo(waypoint: number): void {
  const shown = isStale.value ? null : shownPlan.value;
  const planned = shown && plannedWaypoint(shown.answer, waypoint);
  if (planned) time.value = planned.arrival_time;
}

// Moves the time to where it belongs in a new plan.
export function settleTime(): void {
  time.value = Math.min(time.value, duration());
  if (isAnchored.value) goTo(selected.value);
}

export function playAt(factor: number): void {
  speed.value = factor;
}

export function togglePlaying(): void {
  if (duration() === 0) return;
  isAnchored.value = false;
  if (!playing.value && time.value >= duration()) time.value = 0;
  playing.value = !playing.value;
}

function step(now: number): void {
  if (!playing.value) return;
  const next = time.value + (Math.min(now - last, 100) / 1000) * speed.value;
  last = now;
  if (next >= duration()) {
    time.value = duration();
    playing.value = false;
    return;
  }
  time.value = next;
  requestAnimationFrame(step);
}

effect(() => {
  if (!playing.value) return;
  last = performance.now();
  requestAnimationFrame(step);
});
