// Objects of a request's scene: each edit returns a new scene or request.
import type { AttachedObject, GoalSet, JointWaypoint, PlanRequest, Pose, Robot, Scene, SceneObject, SceneShape } from '../service/types';
import { withoutEmpty } from './edits';
import { framePose, toolPose } from '../robot/tool_pose';
import { poseInFrame, transformed, frameInBase } from './frames';
import { composed, inverted } from './poses';

export type Thing = SceneObject | AttachedObject;

// The shapes that are added as they are, by their kinds, m.
export const FIRST_SHAPES = {
  box: { kind: 'box', size: [0.2, 0.2, 0.2] },
  sphere: { kind: 'sphere', radius: 0.1 },
  cylinder: { kind: 'cylinder', radius: 0.1, length: 0.2 },
  capsule: { kind: 'capsule', radius: 0.1, length: 0.2 },
  half_space: { kind: 'half_space', normal: [0, 0, 1], offset: 0 },
} as const satisfies Record<string, SceneShape>;

type Handling = Pick<JointWaypoint, 'attach' | 'detach'>;

// The shapes that are attached to the tool as they are, by their kinds, m.
export const FIRST_ATTACHED = {
  box: { kind: 'box', size: [0.08, 0.08, 0.08] },
  sphere: { kind: 'sphere', radius: 0.04 },
  cylinder: { kind: 'cylinder', radius: 0.04, length: 0.08 },
} as const satisfies Record<string, AttachedObject['shape']>;

const FIRST_HELD_PLACE = [0, 0, 0.04]; // m: these shapes begin at the tool centre point
const FIRST_PLACE = [0.8, -0.8, 0.1]; // m: beside most arms
const UPRIGHT = { kind: 'quaternion' as const, xyzw: [0, 0, 0, 1] };

// A request with its own scene, in place of one that the service keeps.
export function withScene(request: PlanRequest, { objects, attached, allowed_pairs, margin }: Scene): PlanRequest {
  return { ...request, scene: withoutEmpty({ objects, attached, allowed_pairs, margin }) };
}

// Of an object around the robot, or of one that is attached to it.
export function withObject(scene: Scene, id: string, changes: Partial<Thing>): Scene {
  const changed = <T extends Thing>(one: T): T => (one.id === id ? withoutEmpty({ ...one, ...changes }) : one);
  return withoutEmpty({ ...scene, objects: scene.objects?.map(changed), attached: scene.attached?.map(changed) });
}

// What has the name has the new one; null: another thing of the scene has it.
export function renamed(scene: Scene, id: string, to: string): Scene | null {
  if (to === '' || namesOf(scene).includes(to)) return null;
  const changed = withObject(scene, id, { id: to });
  const swap = (name: string): string => (name === id ? to : name);
  return withoutEmpty({
    ...changed,
    allowed_pairs: scene.allowed_pairs?.map((pair) => pair.map(swap)),
    attached: changed.attached?.map((held) => withoutEmpty({ ...held, touch_links: held.touch_links?.map(swap) })),
  });
}

// The request with another name of an object at waypoints, in the options of goal sets and in speed zones.
export function withNewName(request: PlanRequest, id: string, to: string): PlanRequest {
  const swap = (name: string): string => (name === id ? to : name);
  const handled = <T extends Handling>(waypoint: T): T =>
    withoutEmpty({
      ...waypoint,
      attach: waypoint.attach?.map((held) => withoutEmpty({ ...held, id: swap(held.id), touch_links: held.touch_links?.map(swap) })),
      detach: waypoint.detach?.map(swap),
    });
  const inOption = (option: GoalSet['options'][number]): GoalSet['options'][number] =>
    option.kind === 'sequence' ? { ...option, waypoints: option.waypoints.map(handled) } : handled(option);
  return withoutEmpty({
    ...request,
    waypoints: request.waypoints.map((one) => (one.kind === 'any_of' ? { ...one, options: one.options.map(inOption) } : handled(one))),
    speed_zones: request.speed_zones?.map((zone) => withoutEmpty({ ...zone, objects: zone.objects?.map(swap) })),
  });
}

export function withoutObject(scene: Scene, id: string): Scene {
  const isOther = (one: Thing): boolean => one.id !== id;
  return withoutEmpty({
    ...scene,
    objects: scene.objects?.filter(isOther),
    attached: scene.attached
      ?.filter(isOther)
      .map((held) => withoutEmpty({ ...held, touch_links: held.touch_links?.filter((name) => name !== id) })),
    allowed_pairs: scene.allowed_pairs?.filter((pair) => !pair.includes(id)),
  });
}

// Another object with a name of its own, which is made from the given one.
export function withAnother(scene: Scene, name: string, shape: SceneShape): [Scene, SceneObject] {
  const position = shape.kind === 'half_space' ? [0, 0, 0] : [...FIRST_PLACE];
  const added: SceneObject = { id: freeName(scene, name), shape, pose: { position, orientation: UPRIGHT } };
  return [{ ...scene, objects: [...(scene.objects ?? []), added] }, added];
}

// Another object at the tool, with a name of its own.
export function withAttached(scene: Scene, name: string, shape: AttachedObject['shape']): [Scene, AttachedObject] {
  const added: AttachedObject = { id: freeName(scene, name), shape, pose: { position: [...FIRST_HELD_PLACE], orientation: UPRIGHT } };
  return [{ ...scene, attached: [...(scene.attached ?? []), added] }, added];
}

function freeName(scene: Scene, name: string): string {
  const taken = namesOf(scene);
  let [id, number] = [name, 2];
  while (taken.includes(id)) id = `${name}_${number++}`;
  return id;
}

// The scene in which these two may touch; a pair that is there already stays once.
export function withAllowedPair(scene: Scene, first: string, second: string): Scene {
  const pairs = scene.allowed_pairs ?? [];
  const isThere = pairs.some((pair) => pair.includes(first) && pair.includes(second));
  return first === second || isThere ? scene : { ...scene, allowed_pairs: [...pairs, [first, second]] };
}

export function withoutAllowedPair(scene: Scene, index: number): Scene {
  return { ...scene, allowed_pairs: scene.allowed_pairs?.filter((_, i) => i !== index) };
}

function namesOf({ objects = [], attached = [] }: Scene): string[] {
  return [...objects, ...attached].map(({ id }) => id);
}

// Where an object is in its frame; without an orientation it has the axes of the frame.
export function poseOfObject({ pose }: Thing): Pose {
  return { position: pose?.position ?? [0, 0, 0], orientation: pose?.orientation ?? UPRIGHT };
}

// Where an object is in the base frame; null: its frame is unknown.
export function objectInBase(object: SceneObject, request: PlanRequest, robot: Robot): Pose | null {
  const frame = frameInBase(object.frame ?? 'world', request, robot);
  return frame && transformed(frame, poseOfObject(object));
}

// The same place in another frame.
export function inFrame(object: SceneObject, frame: string, request: PlanRequest, robot: Robot): Partial<SceneObject> {
  const at = objectInBase(object, request, robot);
  return { frame, ...(at ? { pose: poseInFrame(at, frame, request, robot) } : {}) };
}

// Where an attached object is in the base frame while the joints are at a position.
export function attachedInBase(held: AttachedObject, request: PlanRequest, robot: Robot, position: readonly number[]): Pose {
  return composed(holderInBase(held.link, request, robot, position), poseOfObject(held));
}

// A pose in the base frame as an object has it that a link holds, or the tool, while the joints are at a position.
export function onLink(pose: Pose, link: string | null | undefined, request: PlanRequest, robot: Robot, position: readonly number[]): Pose {
  return composed(inverted(holderInBase(link, request, robot, position)), pose);
}

function holderInBase(link: string | null | undefined, request: PlanRequest, robot: Robot, position: readonly number[]): Pose {
  return link ? framePose(robot, position, link) : toolPose(robot, position, request.tool ?? null);
}
