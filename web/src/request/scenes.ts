// Objects of a request's scene: each edit returns a new scene or request.
import type { GoalSet, JointWaypoint, PlanRequest, Pose, Robot, Scene, SceneObject, SceneShape } from '../service/types';
import { withoutEmpty } from './edits';
import { poseInFrame, transformed, frameInBase } from './frames';

// The shapes that are added as they are, by their kinds, m.
export const FIRST_SHAPES = {
  box: { kind: 'box', size: [0.2, 0.2, 0.2] },
  sphere: { kind: 'sphere', radius: 0.1 },
  cylinder: { kind: 'cylinder', radius: 0.1, length: 0.2 },
  capsule: { kind: 'capsule', radius: 0.1, length: 0.2 },
  half_space: { kind: 'half_space', normal: [0, 0, 1], offset: 0 },
} as const satisfies Record<string, SceneShape>;

type Handling = Pick<JointWaypoint, 'attach' | 'detach'>;

const FIRST_PLACE = [0.8, -0.8, 0.1]; // m: beside most arms
const UPRIGHT = { kind: 'quaternion' as const, xyzw: [0, 0, 0, 1] };

// A request with its own scene, in place of one that the service keeps.
export function withScene(request: PlanRequest, { objects, attached, allowed_pairs, margin }: Scene): PlanRequest {
  return { ...request, scene: withoutEmpty({ objects, attached, allowed_pairs, margin }) };
}

export function withObject(scene: Scene, id: string, changes: Partial<SceneObject>): Scene {
  return { ...scene, objects: scene.objects?.map((one) => (one.id === id ? withoutEmpty({ ...one, ...changes }) : one)) };
}

// What has the name has the new one; null: another thing of the scene has it.
export function renamed(scene: Scene, id: string, to: string): Scene | null {
  if (to === '' || namesOf(scene).includes(to)) return null;
  const changed = withObject(scene, id, { id: to });
  const swap = (name: string): string => (name === id ? to : name);
  return {
    ...changed,
    allowed_pairs: scene.allowed_pairs?.map((pair) => pair.map(swap)),
    attached: scene.attached?.map((held) => withoutEmpty({ ...held, touch_links: held.touch_links?.map(swap) })),
  };
}

// The request with another name of an object at waypoints, in the options of goal sets and in speed zones.
export function withNewName(request: PlanRequest, id: string, to: string): PlanRequest {
  const swap = (name: string): string => (name === id ? to : name);
  const handled = <T extends Handling>(waypoint: T): T =>
    withoutEmpty({
      ...waypoint,
      attach: waypoint.attach?.map((held) => ({ ...held, id: swap(held.id) })),
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
  return {
    ...scene,
    objects: scene.objects?.filter((one) => one.id !== id),
    allowed_pairs: scene.allowed_pairs?.filter((pair) => !pair.includes(id)),
  };
}

// Another object with a name of its own, which is made from the given one.
export function withAnother(scene: Scene, name: string, shape: SceneShape): [Scene, SceneObject] {
  const taken = namesOf(scene);
  let [id, number] = [name, 2];
  while (taken.includes(id)) id = `${name}_${number++}`;
  const position = shape.kind === 'half_space' ? [0, 0, 0] : FIRST_PLACE;
  const added: SceneObject = { id, shape, pose: { position: [...position], orientation: UPRIGHT } };
  return [{ ...scene, objects: [...(scene.objects ?? []), added] }, added];
}

function namesOf({ objects = [], attached = [] }: Scene): string[] {
  return [...objects, ...attached].map(({ id }) => id);
}

// Where an object is in its frame; without an orientation it has the axes of the frame.
export function poseOfObject({ pose }: SceneObject): Pose {
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
