// The shapes that the robot is drawn by: those to look at or, where a person asks for them, those that can collide.
import { computed, effect, signal } from '@preact/signals';
import { client, outcome } from '../service/client';
import type { LinkShape, Robot } from '../service/types';
import { links, robot } from './store';

// The file of visual meshes, which the stage reads: it computes with three.
export const visuals = signal<{ of: Robot; file: ArrayBuffer } | null>(null);

export const showsSolids = signal(false);

// Whether the robot has something to look at besides what can collide.
export const hasVisuals = computed(
  () => (robot.value?.geometry?.length ?? 0) > 0 || (visuals.value !== null && visuals.value.of === robot.value),
);

export function toggleSolids(): void {
  showsSolids.value = !showsSolids.value;
  if (robot.value && links.value.length === 0) void showLinks(robot.value);
}

export async function showLinks(arm: Robot): Promise<void> {
  const shapes = await linksOf(arm);
  if (robot.value === arm) links.value = shapes;
}

export async function linksOf(arm: Robot): Promise<readonly LinkShape[]> {
  const found = await outcome(client.GET('/v1/robots/{id}/geometry', { params: { path: { id: arm.id } } }));
  return typeof found.answer === 'object' ? found.answer.shapes : []; // it could be glTF, had we asked for it
}

// The visual meshes come after the robot: until then it is drawn by what it has.
export function followVisuals(): void {
  effect(() => {
    const arm = robot.value;
    if (arm?.has_visual_meshes) void loadVisuals(arm);
  });
}

async function loadVisuals(arm: Robot): Promise<void> {
  const file = await visualsOf(arm);
  if (file && robot.value === arm) visuals.value = { of: arm, file };
}

export async function visualsOf(arm: Robot): Promise<ArrayBuffer | null> {
  const call = client.GET('/v1/robots/{id}/visuals', { params: { path: { id: arm.id } }, parseAs: 'arrayBuffer' });
  const { answer } = await outcome<ArrayBuffer>(call);
  return answer ?? null;
}
