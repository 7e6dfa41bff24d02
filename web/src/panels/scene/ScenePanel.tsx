// The scene: its objects with their forms, files that become objects, and scenes that the service keeps.
import { useEffect, useState } from 'preact/hooks';
import { FIRST_ATTACHED, FIRST_SHAPES } from '../../request/scenes';
import type { PlanRequest, Robot } from '../../service/types';
import { importFault, importObject } from '../../state/importing';
import {
  addObject,
  attachObject,
  chooseObject,
  editScene,
  listScenes,
  openScene,
  saveScene,
  sceneProblem,
  storedScenes,
} from '../../state/scene_editing';
import { chosenObject } from '../../state/store';
import { scene } from '../../state/surroundings';
import { LENGTHS, lengthUnit } from '../../state/units';
import type { Length } from '../../state/units';
import { texts } from '../../texts';
import { Choice, NumberField, TextField } from '../fields';
import { Menu } from '../Menu';
import { ProblemText } from '../Message';
import { More } from '../MoreFields';
import { wordOf } from '../SimpleField';
import { AllowedPairs } from './AllowedPairs';
import { AttachedForm } from './AttachedForm';
import { ObjectForm } from './ObjectForm';

const KINDS = Object.keys(FIRST_SHAPES) as (keyof typeof FIRST_SHAPES)[];
const ATTACHED_KINDS = Object.keys(FIRST_ATTACHED) as (keyof typeof FIRST_ATTACHED)[];

export function ScenePanel({ request, robot }: { request: PlanRequest; robot: Robot }) {
  const { objects = [], attached = [] } = scene.value ?? {};
  const shown = [
    ...objects.map(({ id, shape }) => ({ id, what: wordOf(shape.kind) })),
    ...attached.map(({ id, shape, link }) => ({ id, what: texts.scene.heldBy(wordOf(shape.kind), link ?? null) })),
  ];
  return (
    <More label={texts.scene.label(shown.length)} onClose={endScene}>
      {() => (
        <>
          <Stored request={request} />
          <ul class="objects" aria-label={texts.scene.objects}>
            {shown.slice(0, MOST_LISTED).map(({ id, what }) => (
              <li key={id}>
                <button
                  type="button"
                  aria-pressed={chosenObject.value === id}
                  onClick={() => chooseObject(chosenObject.value === id ? null : id)}
                >
                  {id} <small>{what}</small>
                </button>
              </li>
            ))}
          </ul>
          {shown.length > MOST_LISTED && <p class="hint">{texts.scene.more(shown.length - MOST_LISTED)}</p>}
          <ObjectForm request={request} robot={robot} />
          <AttachedForm robot={robot} />
          <div class="buttons wrap">
            <Menu
              label={texts.scene.add}
              groups={[{ items: KINDS.map((kind) => ({ text: wordOf(kind), onChoose: () => addObject(kind, FIRST_SHAPES[kind]) })) }]}
            />
            <Menu
              label={texts.scene.attach}
              groups={[
                { items: ATTACHED_KINDS.map((kind) => ({ text: wordOf(kind), onChoose: () => attachObject(kind, FIRST_ATTACHED[kind]) })) },
              ]}
            />
          </div>
          <Import />
          {scene.value && (
            <NumberField
              label={texts.scene.margin}
              unit="m"
              value={scene.value.margin}
              placeholder="0"
              min={0}
              onValue={(margin) => scene.value && editScene({ ...scene.value, margin })}
            />
          )}
          {scene.value && <AllowedPairs scene={scene.value} robot={robot} />}
          {scene.value && <Save key={typeof request.scene === 'string' ? request.scene : ''} request={request} />}
        </>
      )}
    </More>
  );
}

function endScene(): void {
  chooseObject(null);
}

const MOST_LISTED = 200; // objects: thousands may stand in a scene

function Stored({ request }: { request: PlanRequest }) {
  useEffect(() => void listScenes(), []);
  const kept = storedScenes.value.map(({ id }) => id);
  const shown = typeof request.scene === 'string' ? request.scene : request.scene ? 'own' : '';
  const ids = shown === '' || shown === 'own' || kept.includes(shown) ? kept : [shown, ...kept];
  const options = [['', texts.scene.none] as const, ['own', texts.scene.own] as const, ...ids.map((id) => [id, id] as const)];
  return <Choice label={texts.scene.shown} value={shown} options={options} onValue={openScene} />;
}

function Import() {
  const [unit, setUnit] = useState<Length>(lengthUnit.value);
  const fault = importFault.value;
  return (
    <>
      <Choice
        label={texts.scene.unit}
        value={unit}
        options={(Object.keys(LENGTHS) as Length[]).map((one) => [one, texts.units.names[one]] as const)}
        onValue={setUnit}
      />
      <label class="file">
        {texts.scene.file}
        <input
          type="file"
          accept=".stl,.obj,.ply,.pcd"
          onChange={(event) => {
            const input = event.currentTarget;
            const [file] = input.files ?? [];
            if (file) void importObject(file, 1 / LENGTHS[unit].factor).then(() => (input.value = ''));
          }}
        />
      </label>
      {fault && (
        <p class="wrong-text" role="alert">
          {texts.scene.fault(fault.name, texts.scene.faults[fault.fault](fault.count))}
        </p>
      )}
    </>
  );
}

function Save({ request }: { request: PlanRequest }) {
  const [id, setId] = useState(typeof request.scene === 'string' ? request.scene : 'cell');
  const problem = sceneProblem.value;
  return (
    <>
      <TextField label={texts.scene.id} value={id} onValue={setId} />
      <button type="button" disabled={id === ''} onClick={() => void saveScene(id)}>
        {texts.scene.save}
      </button>
      {problem && (
        <div class="wrong-text" role="alert">
          <ProblemText problem={problem} />
        </div>
      )}
    </>
  );
}
