// What the page says: to those who listen, to everybody until it is closed, and why there is no plan.
import type { Problem } from '../service/types';
import { banner, notice, problem } from './store';
import type { Banner } from './store';

export function say(text: string): void {
  notice.value = text;
}

export function showBanner(shown: Banner | null): void {
  banner.value = shown;
}

export function refuse(refused: Problem): void {
  problem.value = refused;
}
