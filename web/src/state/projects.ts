// Requests that a person keeps by name in this browser.
import { signal } from '@preact/signals';
import { documentOf } from '../request/cells';
import { parseRequest } from '../request/parse';
import type { CellRequest, PlanRequest, Problem } from '../service/types';
import { texts } from '../texts';
import { openRequest } from './actions';
import { request } from './store';

// As the service plans them: a cell as a whole.
type Projects = Readonly<Record<string, PlanRequest | CellRequest>>;

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
    return Object.fromEntries(found.filter(([, value]) => parseRequest(JSON.stringify(value)).request));
  } catch {
    return {};
  }
}

// The browser may have no room for it; or it has another project of this name, which this tab has not seen.
export function saveProject(name: string, overwrites = false): Failure | null {
  const [shown, stored] = [request.value && documentOf(request.value), kept()[name]];
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

// The request of a project; null: there is none.
export function projectRequest(name: string): PlanRequest | null {
  return parseRequest(JSON.stringify(projects.value[name] ?? null)).request ?? null;
}

export function openProject(name: string): null {
  const stored = JSON.stringify(kept()[name] ?? null);
  const { request: found } = parseRequest(stored);
  if (!found) return null;
  seen.set(name, stored);
  openRequest(found, texts.projects.opened(name));
  return null;
}
