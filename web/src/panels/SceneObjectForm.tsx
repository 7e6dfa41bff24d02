// The form of the chosen object: its name, place, shape and margin.
import { useEffect, useState } from 'preact/hooks';
import { inFrame, poseOfObject } from '../request/scenes';
import type { PlanRequest, Robot } from '../service/types';
import { schemas } from '../state/schemas';
import { editObject, removeObject, renameObject, shownObject } from '../state/scene_editing';
import { texts } from '../texts';
import { Choice, TextField } from './fields';
import { PoseFields } from './PoseFields';
import { ObjectFields } from './SchemaFields';

const ELSEWHERE = ['id', 'pose', 'frame']; // fields with a form of their own

export function SceneObjectForm({ request, robot }: { request: PlanRequest; robot: Robot }) {
  const [taken, setTaken] = useState<string | null>(null);
  const object = shownObject.value;
  useEffect(() => setTaken(null), [object?.id]);
  if (!object) return null;
  const { id } = object;
  const frames = ['world', 'base', ...Object.keys(request.frames ?? {})];
  return (
    <fieldset class="group">
      <legend>{id}</legend>
      <TextField
        key={`${id} ${taken ?? ''}`}
        label={texts.fields.name}
        value={id}
        onValue={(name) => setTaken(name === id || renameObject(id, name) ? null : name)}
      />
      <Choice
        label={texts.scene.frame}
        value={object.frame ?? 'world'}
        options={frames.map((frame) => [frame, frame === 'world' || frame === 'base' ? texts.scene.frames[frame] : frame] as const)}
        onValue={(frame) => editObject(id, inFrame(object, frame, request, robot))}
      />
      {taken !== null && (
        <p class="wrong-text" role="alert">
          {texts.scene.taken(taken)}
        </p>
      )}
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
