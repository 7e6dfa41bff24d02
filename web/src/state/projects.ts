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

function kept(): Projects {
  try {
    const found = Object.entries(JSON.parse(localStorage.getItem(KEY) ?? '{}') as object);
    const parsed = found.map(([name, value]) => [name, parseRequest(JSON.stringify(value)).request] as const);
    return Object.fromEntries(parsed.filter((one): one is readonly [string, PlanRequest] => one[1] !== undefined));
  } catch {
    return {};
  }
}

// False: the browser has no room for it.
export function saveProject(name: string): boolean {
  return !request.value || keep({ ...projects.value, [name]: request.value });
}

export function deleteProject(name: string): void {
  keep(Object.fromEntries(Object.entries(projects.value).filter(([other]) => other !== name)));
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
  const found = projects.value[name];
  if (found) openRequest(found, texts.projects.opened(name));
}
