// The tool by hand: where it is, and steps along and about the axes of a frame.
import { signal, useComputed } from '@preact/signals';
import { degrees, radians, tenths } from '../plan/units';
import { quaternionOf, rpyOfQuaternion } from '../request/rotations';
import { chooseFrame, frame, frames, jog, readout } from '../state/jogging';
import { texts } from '../texts';
import { Choice } from './fields';

const DISTANCES = ['0.1', '1', '10', '50'] as const; // mm
const ANGLES = ['0.1', '1', '5', '15'] as const; // degrees
const distance = signal<(typeof DISTANCES)[number]>('10');
const angle = signal<(typeof ANGLES)[number]>('5');

export function Jog() {
  return (
    <section class="jog" aria-label={texts.jog.label}>
      <h3>{texts.jog.label}</h3>
      <div class="way">
        <Choice label={texts.jog.frame} value={frame.value} options={frames.value.map(named)} onValue={chooseFrame} />
        <span class="vector two">
          <Choice
            label={texts.jog.distance}
            value={distance.value}
            options={DISTANCES.map(twice)}
            onValue={(next) => (distance.value = next)}
          />
          <Choice label={texts.jog.angle} value={angle.value} options={ANGLES.map(twice)} onValue={(next) => (angle.value = next)} />
        </span>
      </div>
      {texts.jog.axes.map((name, axis) => (
        <Axis key={name} name={name} axis={axis} />
      ))}
    </section>
  );
}

function named(name: string): readonly [string, string] {
  return [name, name === 'base' || name === 'tool' ? texts.editor.frames[name] : name];
}

function twice<T extends string>(text: T): readonly [T, string] {
  return [text, text];
}

// While the motion is played only the number changes.
function Axis({ name, axis }: { name: string; axis: number }) {
  const [kind, of] = axis < 3 ? (['shift', axis] as const) : (['turn', axis - 3] as const);
  const shown = useComputed(() => valueOf(axis));
  const step = (sign: number): void =>
    jog(kind, of, sign * (kind === 'shift' ? Number(distance.value) / 1000 : radians(Number(angle.value))));
  return (
    <div class="axis">
      <span>{name}</span>
      <button type="button" aria-label={texts.jog.less(name)} onClick={() => step(-1)}>
        −
      </button>
      <output>{shown}</output>
      <button type="button" aria-label={texts.jog.more(name)} onClick={() => step(1)}>
        +
      </button>
    </div>
  );
}

function valueOf(axis: number): string {
  const at = readout.value;
  const turn = at && quaternionOf(at.orientation);
  if (!at || !turn) return '–';
  return axis < 3 ? `${tenths(at.position[axis]! * 1000)} mm` : `${tenths(degrees(rpyOfQuaternion(turn)[axis - 3]!))} °`;
}
