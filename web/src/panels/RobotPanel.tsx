// The robot that is shown: sliders for its joints, its limits and where they come from; and robots of the user's own.
import { useComputed } from '@preact/signals';
import { jointWaypoint } from '../request/edits';
import { decimal, short, shownIn, unitOf } from '../plan/units';
import type { Quantity } from '../plan/units';
import type { Joint, Robot } from '../service/types';
import { insert } from '../state/actions';
import { jogJoint } from '../state/jogging';
import { jointPosition, pose } from '../state/jointPosition';
import { request, robot } from '../state/store';
import { texts } from '../texts';
import { Jog } from './Jog';
import { RobotNote } from './RobotNotes';
import { RobotUpload } from './RobotUpload';
import { Workspace } from './Workspace';

export function RobotPanel() {
  const arm = robot.value;
  return (
    <>
      {arm && <Sliders arm={arm} />}
      {arm && <Jog />}
      {arm && <Workspace />}
      {arm && <LimitTable arm={arm} />}
      {arm && (arm.notes?.length ?? 0) > 0 && <NoteList arm={arm} />}
      <RobotUpload />
    </>
  );
}

function NoteList({ arm }: { arm: Robot }) {
  return (
    <section aria-label={texts.robot.aboutRobot}>
      <h3>{texts.robot.aboutRobot}</h3>
      <ul class="note-list">
        {arm.notes?.map((note) => (
          <RobotNote key={note} note={note} />
        ))}
      </ul>
    </section>
  );
}

function Sliders({ arm }: { arm: Robot }) {
  return (
    <section class="sliders" aria-label={texts.robot.sliders}>
      <h3>{texts.robot.sliders}</h3>
      {arm.joints.map((joint, index) => (
        <Slider key={`${joint.name} ${String(rangeOf(joint))}`} joint={joint} index={index} />
      ))}
      <div class="buttons wrap">
        {Object.entries(arm.named_positions).map(([name, position]) => (
          <button key={name} type="button" onClick={() => pose(position)}>
            {name}
          </button>
        ))}
        <button type="button" class="primary" disabled={!request.value} onClick={() => insert(jointWaypoint(jointPosition.value))}>
          {texts.robot.add}
        </button>
      </div>
    </section>
  );
}

// While the motion is played it is drawn once: what changes in each frame are its knob and its number.
function Slider({ joint, index }: { joint: Joint; index: number }) {
  const [lower, upper] = rangeOf(joint);
  const unit = unitOf(joint, 'position');
  const value = useComputed(() => jointPosition.value[index] ?? 0);
  const text = useComputed(() => `${decimal(value.value, unit)} ${shownIn(unit).name}`);
  return (
    <label>
      <span>{joint.name}</span>
      <input
        type="range"
        min={lower}
        max={upper}
        step="any"
        value={value}
        onInput={(event) => jogJoint(index, event.currentTarget.valueAsNumber)}
      />
      <output>{text}</output>
    </label>
  );
}

// A joint without limits goes once around, or a metre.
function rangeOf({ kind, lower, upper }: Joint): [number, number] {
  const most = kind === 'prismatic' ? 1 : Math.PI;
  return [lower ?? -most, upper ?? most];
}

const LIMITS: readonly Quantity[] = ['position', 'velocity', 'acceleration', 'jerk', 'torque'];

function LimitTable({ arm }: { arm: Robot }) {
  return (
    <>
      <h3>{texts.robot.limits}</h3>
      <div class="wide-table" tabIndex={0} role="region" aria-label={texts.robot.limits}>
        <table>
          <thead>
            <tr>
              <th scope="col">{texts.plots.joint}</th>
              {LIMITS.map((quantity) => (
                <th key={quantity} scope="col">
                  {texts.quantities[quantity]}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {arm.joints.map((joint) => (
              <tr key={joint.name}>
                <th scope="row">{joint.name}</th>
                {LIMITS.map((quantity) => (
                  <td key={quantity}>
                    {limitOf(joint, quantity)}
                    <small>{sourceOf(joint, quantity)}</small>
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

function limitOf(joint: Joint, quantity: Quantity): string {
  const { factor, name } = shownIn(unitOf(joint, quantity));
  const text = (value: number | null): string => (value === null ? texts.result.unlimited : short(value * factor, 4));
  const range = quantity === 'position' ? [joint.lower, joint.upper] : quantity === 'jerk' ? null : joint[`${quantity}_range`];
  if (quantity === 'position' && joint.lower === null && joint.upper === null) return texts.result.unlimited;
  if (range) return `${texts.robot.fromTo(text(range[0]!), text(range[1]!))} ${name}`;
  const value = quantity === 'position' ? null : joint[quantity];
  return value === null ? texts.result.unlimited : `±${text(value)} ${name}`;
}

function sourceOf({ provenance }: Joint, quantity: string): string | undefined {
  const source = provenance[quantity];
  return source && texts.robot.sources[source];
}
