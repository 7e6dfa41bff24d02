// Requests that a person keeps by name in this browser.
import { signal } from '@preact/signals';
import { parseRequest } from '../request/parse';
import type { PlanRequest, Problem } from '../service/types';
import { texts } from '../texts';
import { openRequest } from './actions';
import { request } from './store';

type Projects = Readonly<Record<string, PlanRequest>>;

// Why a project was not saved, opened or deleted: there is no room, another page has changed it, it is no request, or the
// service says so.
export type Failure = { why: 'full' | 'changed' } | { fault: string } | { problem: Problem };

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
export function saveProject(name: string, overwrites = false): Failure | null {
  const [shown, stored] = [request.value, kept()[name]];
  if (!shown) return null;
  const [ours, theirs] = [JSON.stringify(shown), JSON.stringify(stored)];
  if (stored && !overwrites && theirs !== ours && theirs !== seen.get(name)) {
    projects.value = kept();
    return { why: 'changed' };
  }
  if (!keep({ ...kept(), [name]: shown })) return { why: 'full' };
  seen.set(name, ours);
  return null;
}

export function deleteProject(name: string): null {
  seen.delete(name);
  keep(Object.fromEntries(Object.entries(kept()).filter(([other]) => other !== name)));
  return null;
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

export function openProject(name: string): null {
  const found = kept()[name];
  if (!found) return null;
  seen.set(name, JSON.stringify(found));
  openRequest(found, texts.projects.opened(name));
  return null;
}
