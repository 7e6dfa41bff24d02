// The scene as it is edited: the chosen object, what a hand moves, and the scenes that the service keeps.
import { computed, effect, signal } from '@preact/signals';
import {
  attachedInBase,
  objectInBase,
  onLink,
  renamed,
  withAnother,
  withAttached,
  withNewName,
  withObject,
  withoutObject,
  withScene,
} from '../request/scenes';
import type { Thing } from '../request/scenes';
import { withoutEmpty } from '../request/edits';
import { poseInFrame } from '../request/frames';
import { client, outcome } from '../service/client';
import { handledNames } from '../request/handled';
import type { AttachedObject, Pose, Problem, Scene, SceneObject, SceneShape, SceneSummary } from '../service/types';
import { show } from './actions';
import { jointPosition } from './jointPosition';
import { chosenObject, request, robot } from './store';
import { movedObject, scene } from './surroundings';

const EMPTY: Scene = { objects: [], margin: 0.01 };

export const storedScenes = signal<readonly SceneSummary[]>([]);
export const sceneProblem = signal<Problem | null>(null);

effect(() => {
  request.value;
  movedObject.value = null;
});

export const shownObject = computed(() => scene.value?.objects?.find(({ id }) => id === chosenObject.value) ?? null);
export const shownAttached = computed(() => scene.value?.attached?.find(({ id }) => id === chosenObject.value) ?? null);
export const shownThing = computed<Thing | null>(() => shownObject.value ?? shownAttached.value);

// Where the chosen object is, in the base frame; null: none is chosen, or it is put down on the way.
export const objectPose = computed(() => {
  const [shown, arm, object, held] = [request.value, robot.value, shownObject.value, shownAttached.value];
  if (!shown || !arm) return null;
  if (object) return objectInBase(object, shown, arm);
  return held && !handledNames(shown).includes(held.id) ? attachedInBase(held, shown, arm, jointPosition.value) : null;
});

export function chooseObject(id: string | null): void {
  chosenObject.value = id;
}

export function editScene(next: Scene): void {
  if (request.value) show(withScene(request.value, next));
}

export function editObject(id: string, changes: Partial<Thing>): void {
  if (scene.value) editScene(withObject(scene.value, id, changes));
}

// False: another thing of the scene has this name.
export function renameObject(id: string, to: string): boolean {
  const next = scene.value && renamed(scene.value, id, to);
  if (!next || !request.value) return false;
  chosenObject.value = to;
  show(withScene(withNewName(request.value, id, to), next));
  return true;
}

export function addObject(name: string, shape: SceneShape): void {
  const [next, added] = withAnother(scene.value ?? EMPTY, name, shape);
  chosenObject.value = added.id;
  editScene(next);
}

export function attachObject(name: string, shape: AttachedObject['shape']): void {
  const [next, added] = withAttached(scene.value ?? EMPTY, name, shape);
  chosenObject.value = added.id;
  editScene(next);
}

// Has another link hold the chosen object, null: the tool. Where the arm stands, the object stays in its place.
export function holdBy(link: string | null): void {
  const [held, at] = [shownAttached.value, objectPose.value];
  if (held) editObject(held.id, { link: link ?? undefined, ...(at ? { pose: heldAt(at, link) } : {}) });
}

export function removeObject(id: string): void {
  chosenObject.value = null;
  if (scene.value) editScene(withoutObject(scene.value, id));
}

// Shows the chosen object at a pose in the base frame, which the request does not have yet.
export function sketchObject(pose: Pose): void {
  if (shownThing.value) movedObject.value = { ...shownThing.value, pose: inItsPlace(pose) };
}

export function placeObject(pose: Pose): void {
  if (shownThing.value) editObject(shownThing.value.id, { pose: inItsPlace(pose) });
}

function inItsPlace(pose: Pose): Pose {
  const object = shownObject.value;
  return object ? inItsFrame(object, pose) : heldAt(pose, shownAttached.value?.link);
}

function heldAt(pose: Pose, link: string | null | undefined): Pose {
  return request.value && robot.value ? onLink(pose, link, request.value, robot.value, jointPosition.peek()) : pose;
}

function inItsFrame({ frame }: SceneObject, pose: Pose): Pose {
  return request.value && robot.value ? poseInFrame(pose, frame ?? 'world', request.value, robot.value) : pose;
}

export async function listScenes(): Promise<void> {
  const { answer } = await outcome(client.GET('/v1/scenes', { params: { query: { limit: 1000 } } }));
  if (answer) storedScenes.value = answer.scenes;
}

// Plans in a scene that the service keeps, in one of the request's own ('own'), or in none.
export function openScene(id: string): void {
  chosenObject.value = null;
  if (id === 'own') editScene(scene.value ?? EMPTY);
  else if (request.value) show(withoutEmpty({ ...request.value, scene: id || undefined }));
}

// Keeps the shown scene on the service under an id, in place of what was there, and plans in it.
export async function saveScene(id: string): Promise<void> {
  const shown = scene.value;
  if (!shown) return;
  const { objects = [], attached = [], allowed_pairs = [], margin = 0 } = shown;
  const body = { objects, attached, allowed_pairs, margin };
  await listScenes();
  const isKept = storedScenes.value.some((kept) => kept.id === id);
  const found = await (isKept ? replaceScene(id, body) : outcome(client.POST('/v1/scenes', { body: { ...body, id } })));
  sceneProblem.value = found.problem ?? null;
  if (found.problem) return;
  await listScenes();
  openScene(id);
}

async function replaceScene(id: string, body: Required<Pick<Scene, 'objects' | 'attached' | 'allowed_pairs' | 'margin'>>) {
  const params = { path: { id } };
  const before = await outcome(client.GET('/v1/scenes/{id}', { params }));
  if (!before.answer) return before;
  const remove = [...before.answer.objects, ...before.answer.attached].map((one) => one.id);
  return outcome(client.PATCH('/v1/scenes/{id}', { params, body: { ...body, remove } }));
}
