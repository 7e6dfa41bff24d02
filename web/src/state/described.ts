// What the service says of robots by their ids: of those that stand in the cell beside the one that is shown.
import { signal } from '@preact/signals';
import { client, outcome } from '../service/client';
import type { LinkShape, Robot } from '../service/types';
import { linksOf, visualsOf } from './shapes';
import { robot } from './store';

export interface Described {
  robot: Robot;
  links: readonly LinkShape[];
  visuals: ArrayBuffer | null;
}

export const described = signal<ReadonlyMap<string, Described>>(new Map());

export function describedRobot(id: string): Robot | null {
  return robot.value?.id === id ? robot.value : (described.value.get(id)?.robot ?? null);
}

// Asks once for each; one that the service does not have stays unknown.
export async function describe(ids: readonly string[]): Promise<void> {
  const unknown = [...new Set(ids)].filter((id) => !described.value.has(id));
  const found = await Promise.all(unknown.map(ask));
  if (found.length > 0) described.value = new Map([...described.value, ...found.filter((one) => one !== null)]);
}

async function ask(id: string): Promise<[string, Described] | null> {
  const { answer } = await outcome(client.GET('/v1/robots/{id}', { params: { path: { id } } }));
  if (!answer) return null;
  const [links, visuals] = await Promise.all([linksOf(answer), answer.has_visual_meshes ? visualsOf(answer) : null]);
  return [id, { robot: answer, links, visuals }];
}
