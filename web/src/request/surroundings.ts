// What one pose of a request is held against, when it is asked about by itself.
import { toolAt } from '../plan/tools';
import type { AttachedObject, InverseKinematicsRequest, PlanRequest, Robot, Scene } from '../service/types';
import { handledNames } from './handled';
import { composed } from './poses';

export type Surroundings = Pick<InverseKinematicsRequest, 'scene' | 'self_collision' | 'frames' | 'mounting'>;

// `scene` is that of the request, or the one that it names by its id; null: not known here.
export function surroundingsOf(request: PlanRequest, scene: Scene | null, index: number, robot: Robot): Surroundings {
  const { self_collision, frames, mounting } = request;
  if (!request.scene) return { self_collision };
  return { scene: scene ? sceneOfPose(request, scene, index, robot) : request.scene, self_collision, frames, mounting };
}

// What is taken or put down at some waypoint may be touched there, so that it is left out; what is held at the request's
// tool stays there where a waypoint has a tool of its own. A scene that is known by its id and stays as it is goes by that.
function sceneOfPose(request: PlanRequest, scene: Scene, index: number, robot: Robot): Surroundings['scene'] {
  const handled = handledNames(request);
  const hasOtherTool = JSON.stringify(toolAt(request, index)) !== JSON.stringify(request.tool ?? null);
  if (handled.length === 0 && !hasOtherTool) return request.scene;
  const isLeft = ({ id }: { id: string }): boolean => !handled.includes(id);
  const attached = (scene.attached ?? []).filter(isLeft).map((held) => ({
    ...(hasOtherTool && !held.link ? atTip(held, request, robot) : held),
    touch_links: held.touch_links?.filter((id) => !handled.includes(id)),
  }));
  return {
    objects: scene.objects?.filter(isLeft),
    attached,
    allowed_pairs: scene.allowed_pairs?.filter((pair) => pair.every((id) => !handled.includes(id))),
    margin: scene.margin,
  };
}

function atTip(held: AttachedObject, { tool }: PlanRequest, robot: Robot): AttachedObject {
  const own = { position: robot.tool.position, orientation: { kind: 'quaternion' as const, xyzw: robot.tool.quaternion_xyzw } };
  return { ...held, link: robot.tip_frame, pose: composed(tool ?? own, held.pose ?? { position: [0, 0, 0] }) };
}
