// What stands around the robot as it is shown, and which pair of things the stage points at.
import { computed, effect, signal } from '@preact/signals';
import { positionAt } from '../plan/samples';
import { toolAt, toolAtTime } from '../plan/tools';
import { withObject } from '../request/scenes';
import type { Thing } from '../request/scenes';
import type { Setting } from '../scene/objects';
import type { Pair } from '../scene/pair';
import { client, outcome } from '../service/client';
import type { Clearance, Scene } from '../service/types';
import { seek, time } from './playback';
import { isStale, ownProblem, plan, request, shownPlan } from './store';

export const KINDS = ['scene', 'itself', 'contacts'] as const;
export type Kind = (typeof KINDS)[number];

const preferred = signal<Kind>('scene');

// A scene that a request names by its id, as the service has it now.
const kept = signal<Scene | null>(null);

// An object of the scene while a hand moves it.
export const movedObject = signal<Thing | null>(null);

// A report, which has no service, does without.
export function followScenes(): void {
  effect(() => {
    plan.value; // it may have changed since the last one
    const asked = request.value?.scene;
    if (typeof asked === 'string') void keptScene(asked);
    else kept.value = null;
  });
}

async function keptScene(id: string): Promise<void> {
  const found = await outcome(client.GET('/v1/scenes/{id}', { params: { path: { id } } }));
  if (request.value?.scene === id) kept.value = found.answer ?? null;
}

// Each changes only when it does itself, so that another duration draws no scene anew.
export const scene = computed(() => {
  const [moved, shown] = [movedObject.value, typeof request.value?.scene === 'string' ? kept.value : request.value?.scene];
  return moved && shown ? withObject(shown, moved.id, moved) : shown;
});
const [frames, tool, mounting] = [
  computed(() => request.value?.frames),
  computed(() => request.value?.tool),
  computed(() => request.value?.mounting),
];

export const setting = computed<Setting>(() => {
  return { scene: scene.value, frames: frames.value, tool: tool.value, mounting: mounting.value };
});

// The tool that the robot has at the time that is shown; it changes only where another is taken.
export const shownTool = computed(() => {
  const shown = shownPlan.value;
  if (shown) return toolAtTime(shown.request, shown.answer, time.value);
  return request.value ? toolAt(request.value, 0) : null;
});

// The margin that a pair has to keep, m: the object's, or what is carried asks for more.
export function marginOf(pair: readonly string[]): number {
  const { objects = [], attached = [], margin = 0 } = scene.value ?? {};
  const ofObject = objects.find(({ id }) => pair.includes(id))?.margin ?? margin;
  return Math.max(ofObject, ...attached.filter(({ id }) => pair.includes(id)).map((held) => held.margin ?? 0));
}

// The clearance that is pointed at: that to the scene, unless that of the arm to itself was chosen.
export const nearest = computed<{ kind: Kind; clearance: Clearance } | null>(() => {
  const found = isStale.value ? null : shownPlan.value?.answer.certificate.clearance;
  const kinds = [preferred.value, ...KINDS].filter((kind) => found?.[kind]?.pair);
  return found && kinds[0] ? { kind: kinds[0], clearance: found[kinds[0]]! } : null;
});

// The pair that a refusal names, else the one that comes nearest.
export const shownPair = computed<Pair | null>(() => {
  const refused = ownProblem.value;
  if (refused) return refused.pair && refused.position ? { names: refused.pair, position: refused.position } : null;
  const { pair, time } = nearest.value?.clearance ?? {};
  return pair && typeof time === 'number' ? { names: pair, position: positionAt(shownPlan.value!.answer, time) } : null;
});

export function goToNearest(kind: Kind): void {
  preferred.value = kind;
  seek(nearest.value?.clearance.time ?? 0);
}
