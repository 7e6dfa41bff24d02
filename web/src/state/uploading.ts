// A robot of the user's own: its files become a request, its findings are shown, and it is chosen.
import { signal } from '@preact/signals';
import { client, outcome } from '../service/client';
import type { Finding, Problem } from '../service/types';
import { chooseRobot } from './actions';
import { loadRobots } from './robots';

export interface RobotFiles {
  id: string;
  urdf: File;
  srdf?: File;
  meshes?: File; // a zip archive
}

export type Upload =
  { kind: 'running' } | { kind: 'added'; id: string; findings: readonly Finding[] } | { kind: 'refused'; problem: Problem };

export const upload = signal<Upload | null>(null);

export async function uploadRobot({ id, urdf, srdf, meshes }: RobotFiles): Promise<void> {
  upload.value = { kind: 'running' };
  const body = {
    kind: 'urdf' as const,
    id,
    urdf: await urdf.text(),
    ...(srdf ? { srdf: await srdf.text() } : {}),
    ...(meshes ? { meshes: base64(new Uint8Array(await meshes.arrayBuffer())) } : {}),
  };
  const found = await outcome(client.POST('/v1/robots', { body }));
  if (!found.answer) {
    upload.value = { kind: 'refused', problem: found.problem };
    return;
  }
  const { findings } = found.answer;
  upload.value = { kind: 'added', id, findings };
  await loadRobots();
  await chooseRobot(id);
}

const CHUNK = 0x8000; // bytes that are turned at once: more arguments than that overflow the stack

export function base64(bytes: Uint8Array): string {
  let binary = '';
  for (let at = 0; at < bytes.length; at += CHUNK) binary += String.fromCharCode(...bytes.subarray(at, at + CHUNK));
  return btoa(binary);
}

// An id from the name of a file: what an id may not have becomes an underscore.
export function idOf(name: string): string {
  return name
    .replace(/\.[^.]*$/, '')
    .replace(/[^A-Za-z0-9_-]+/g, '_')
    .replace(/^[^A-Za-z0-9]+/, '')
    .slice(0, 64);
}
