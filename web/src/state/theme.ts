// Dark or light: as the system says, unless chosen here.
import { signal } from '@preact/signals';

export type Theme = 'dark' | 'light';

const system = matchMedia('(prefers-color-scheme: dark)');
const chosen = localStorage.getItem('theme');

export const theme = signal<Theme>(chosen === 'dark' || chosen === 'light' ? chosen : systemTheme());
document.documentElement.dataset.theme = theme.value;

function systemTheme(): Theme {
  return system.matches ? 'dark' : 'light';
}

function apply(next: Theme): void {
  document.documentElement.dataset.theme = next;
  theme.value = next;
}

system.addEventListener('change', () => {
  if (localStorage.getItem('theme') === null) apply(systemTheme());
});

export function switchTheme(): void {
  const next = theme.value === 'dark' ? 'light' : 'dark';
  localStorage.setItem('theme', next);
  apply(next);
}

// The value of one of the style sheet's variables.
export function styleColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
