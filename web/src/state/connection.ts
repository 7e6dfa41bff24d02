// Waits for a service that is out of reach, and goes on when it is back.
import { effect } from '@preact/signals';
import { base, isAway } from '../service/client';
import type { PlanRequest } from '../service/types';
import { texts } from '../texts';
import { settle } from './actions';
import { banner, isStale, plan, problem, request } from './store';

const [FIRST_PAUSE, LONGEST_PAUSE] = [1000, 5000]; // ms between two questions

let isWaiting = false;

// Loads the lists again when the service is back, and has planned what has no plan yet.
export function followConnection(loadLists: () => void): void {
  effect(() => {
    if (!isAway.value || isWaiting) return;
    isWaiting = true;
    void ready().then(() => {
      isWaiting = false;
      isAway.value = false;
      loadLists();
      resume();
    });
  });
}

async function ready(): Promise<void> {
  for (let pause = FIRST_PAUSE; !(await isReady()); pause = Math.min(LONGEST_PAUSE, 1.5 * pause)) {
    await new Promise((resolve) => setTimeout(resolve, pause));
  }
}

async function isReady(): Promise<boolean> {
  try {
    return (await fetch(`${base}/readyz`)).ok;
  } catch {
    return false;
  }
}

let resent: PlanRequest | null = null;

// A request is sent again once: one that is never answered may be what ends the service.
function resume(): void {
  if (problem.value?.status === 0) problem.value = null;
  if (plan.value && !isStale.value) return;
  if (request.value === resent) {
    banner.value = { text: texts.said.notResent };
    return;
  }
  resent = request.value;
  void settle();
}
