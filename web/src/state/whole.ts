// What fills the window: the stage, the plots, or null: neither. Escape leads back.
import { effect, signal } from '@preact/signals';

export const whole = signal<'stage' | 'plots' | null>(null);

export function toggleWhole(part: 'stage' | 'plots'): void {
  whole.value = whole.value === part ? null : part;
}

effect(() => {
  const { documentElement } = document;
  if (whole.value) documentElement.dataset.whole = whole.value;
  else delete documentElement.dataset.whole;
});

addEventListener('keydown', ({ key }) => {
  if (key === 'Escape') whole.value = null;
});
