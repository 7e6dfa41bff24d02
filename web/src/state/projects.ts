// Requests that a person keeps by name in this browser: the service keeps robots and scenes, but no requests.
import { signal } from '@preact/signals';
import { parseRequest } from '../request/parse';
import type { PlanRequest } from '../service/types';
import { texts } from '../texts';
import { openRequest } from './actions';
import { request } from './store';

type Projects = Readonly<Record<string, PlanRequest>>;

const KEY = 'projects';

export const projects = signal<Projects>(kept());

// What this tab has opened or saved, by name: a project that differs from it was changed elsewhere.
const seen = new Map<string, string>();

addEventListener('storage', ({ key }) => {
  if (key === KEY || key === null) projects.value = kept();
});

function kept(): Projects {
  try {
    const found = Object.entries(JSON.parse(localStorage.getItem(KEY) ?? '{}') as object);
    const parsed = found.map(([name, value]) => [name, parseRequest(JSON.stringify(value)).request] as const);
    return Object.fromEntries(parsed.filter((one): one is readonly [string, PlanRequest] => one[1] !== undefined));
  } catch {
    return {};
  }
}

// The browser may have no room for it; or it has another project of this name, which this tab has not seen.
export function saveProject(name: string, overwrites = false): 'saved' | 'full' | 'changed' {
  const [shown, stored] = [request.value, kept()[name]];
  if (!shown) return 'saved';
  const [ours, theirs] = [JSON.stringify(shown), JSON.stringify(stored)];
  if (stored && !overwrites && theirs !== ours && theirs !== seen.get(name)) {
    projects.value = kept();
    return 'changed';
  }
  if (!keep({ ...kept(), [name]: shown })) return 'full';
  seen.set(name, ours);
  return 'saved';
}

export function deleteProject(name: string): void {
  seen.delete(name);
  keep(Object.fromEntries(Object.entries(kept()).filter(([other]) => other !== name)));
}

function keep(next: Projects): boolean {
  try {
    localStorage.setItem(KEY, JSON.stringify(next));
  } catch {
    return false;
  }
  projects.value = next;
  return true;
}

export function openProject(name: string): void {
  const found = kept()[name];
  if (!found) return;
  seen.set(name, JSON.stringify(found));
  openRequest(found, texts.projects.opened(name));
}
