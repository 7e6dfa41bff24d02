// The form of the chosen object around the robot: its name, place, shape and margin.
import { inFrame, poseOfObject } from '../../request/scenes';
import type { PlanRequest, Robot } from '../../service/types';
import { schemas } from '../../state/schemas';
import { editObject, removeObject, shownObject } from '../../state/scene_editing';
import { texts } from '../../texts';
import { Choice } from '../fields';
import { PoseFields } from '../PoseFields';
import { ObjectFields } from '../SchemaFields';
import { NameOfThing } from './names';

const ELSEWHERE = ['id', 'pose', 'frame']; // fields with a form of their own

export function ObjectForm({ request, robot }: { request: PlanRequest; robot: Robot }) {
  const object = shownObject.value;
  if (!object) return null;
  const { id } = object;
  const frames = ['world', 'base', ...Object.keys(request.frames ?? {})];
  return (
    <fieldset class="group">
      <legend>{id}</legend>
      <NameOfThing id={id} />
      <Choice
        label={texts.scene.frame}
        value={object.frame ?? 'world'}
        options={frames.map((frame) => [frame, frame === 'world' || frame === 'base' ? texts.scene.frames[frame] : frame] as const)}
        onValue={(frame) => editObject(id, inFrame(object, frame, request, robot))}
      />
      <PoseFields pose={poseOfObject(object)} onPose={(pose) => editObject(id, { pose })} />
      {schemas.value && (
        <ObjectFields
          schema={schemas.value.SceneObject!}
          value={object}
          skip={ELSEWHERE}
          forms={{ schemas: schemas.value, joints: robot.joints, pose: poseOfObject(object) }}
          onValue={(next) => editObject(id, { margin: undefined, ...next })}
        />
      )}
      <button type="button" onClick={() => removeObject(id)}>
        {texts.scene.remove}
      </button>
    </fieldset>
  );
}
