// The form of the chosen object that is attached to the robot: its name, link, place, shape, margin and what may touch it.
import { poseOfObject } from '../../request/scenes';
import type { Robot } from '../../service/types';
import { schemas } from '../../state/schemas';
import { editObject, holdBy, removeObject, shownAttached } from '../../state/scene_editing';
import { scene } from '../../state/surroundings';
import { texts } from '../../texts';
import { Choice } from '../fields';
import { PoseFields } from '../PoseFields';
import { ObjectFields } from '../SchemaFields';
import { linksOf, NameChoice, NameOfThing, Removable } from './names';

const ELSEWHERE = ['id', 'pose', 'link', 'touch_links']; // fields with a form of their own

export function AttachedForm({ robot }: { robot: Robot }) {
  const held = shownAttached.value;
  if (!held) return null;
  const { id, touch_links: touched = [] } = held;
  const links = linksOf(robot);
  const others = [...links, ...(scene.value?.attached ?? []).map((one) => one.id)].filter(
    (name) => name !== id && name !== held.link && !touched.includes(name),
  );
  const touch = (names: string[]): void => editObject(id, { touch_links: names.length > 0 ? names : undefined });
  return (
    <fieldset class="group">
      <legend>{id}</legend>
      <NameOfThing id={id} />
      <Choice
        label={texts.scene.link}
        value={held.link ?? ''}
        options={[['', texts.scene.tool] as const, ...links.map((name) => [name, name] as const)]}
        onValue={(link) => holdBy(link || null)}
      />
      <PoseFields pose={poseOfObject(held)} onPose={(pose) => editObject(id, { pose })} />
      {schemas.value && (
        <ObjectFields
          schema={schemas.value.AttachedObject!}
          value={held}
          skip={ELSEWHERE}
          forms={{ schemas: schemas.value, joints: robot.joints, pose: poseOfObject(held) }}
          onValue={(next) => editObject(id, { margin: undefined, ...next })}
        />
      )}
      <ul class="names" aria-label={texts.scene.touched}>
        {touched.map((name) => (
          <Removable key={name} text={name} onRemove={() => touch(touched.filter((other) => other !== name))} />
        ))}
      </ul>
      <NameChoice label={texts.scene.touch} names={others} onValue={(name) => name && touch([...touched, name])} />
      <button type="button" onClick={() => removeObject(id)}>
        {texts.scene.remove}
      </button>
    </fieldset>
  );
}
