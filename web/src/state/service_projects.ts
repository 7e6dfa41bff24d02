// Requests that the service keeps by name: other browsers open them, too, with keys those with the same key.
import { signal } from '@preact/signals';
import { documentOf } from '../request/cells';
import { parseRequest } from '../request/parse';
import { client, outcome } from '../service/client';
import type { Outcome } from '../service/client';
import type { ProjectSummary } from '../service/types';
import { texts } from '../texts';
import { openRequest } from './actions';
import type { Failure } from './projects';
import { request } from './store';

export const serviceProjects = signal<readonly ProjectSummary[]>([]);

// The states of projects that this page has opened or saved, by name; and those that it has been told of since.
const seen = new Map<string, string>();
const told = new Map<string, string>();

export async function listProjects(): Promise<void> {
  const { answer } = await outcome(client.GET('/v1/projects', { params: { query: { limit: 1000 } } }));
  if (answer) serviceProjects.value = answer.projects;
}

// A project that another browser has changed is overwritten only where a person says so; one that is deleted comes back.
export async function saveOnService(name: string, overwrites = false): Promise<Failure | null> {
  if (!request.value) return null;
  const body = { ...documentOf(request.value) };
  const put = (tag: string | undefined): Promise<Outcome<ProjectSummary>> => {
    const header = tag === undefined ? { 'If-None-Match': '*' } : { 'If-Match': tag };
    return outcome(client.PUT('/v1/projects/{name}', { params: { path: { name }, header }, body }));
  };
  let found = await put((overwrites && told.get(name)) || seen.get(name));
  if (found.problem?.code === 'project_changed' && found.tag === undefined) found = await put(undefined);
  await listProjects();
  const { problem, tag } = found;
  if (!problem) return see(name, tag);
  if (problem.code !== 'project_changed' || tag === undefined) return { problem };
  told.set(name, tag);
  return { why: 'changed' };
}

export async function openFromService(name: string): Promise<Failure | null> {
  const { answer, problem, tag } = await outcome(client.GET('/v1/projects/{name}', { params: { path: { name } } }));
  if (problem) {
    await listProjects();
    return { problem };
  }
  const { request: found, fault } = parseRequest(JSON.stringify(answer));
  if (!found) return { fault };
  see(name, tag);
  openRequest(found, texts.projects.opened(name));
  return null;
}

// Deletes a project in the state of the list: one that was saved since stays.
export async function deleteOnService(name: string): Promise<Failure | null> {
  const listed = serviceProjects.value.find((one) => one.name === name);
  const header = listed && { 'If-Match': `"${listed.content}"` };
  const { problem } = await outcome(client.DELETE('/v1/projects/{name}', { params: { path: { name }, header } }));
  await listProjects();
  return problem && problem.code !== 'unknown_project' ? { problem } : null;
}

function see(name: string, tag: string | undefined): null {
  told.delete(name);
  if (tag !== undefined) seen.set(name, tag);
  return null;
}
