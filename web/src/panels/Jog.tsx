// The tool by hand: where it is, and steps along and about the axes of a frame.
import { signal, useComputed } from '@preact/signals';
import { decimal, inService, shownIn, withUnit } from '../plan/units';
import { quaternionOf, rpyOfQuaternion } from '../request/rotations';
import { chooseFrame, frame, frames, jog, readout } from '../state/jogging';
import { ANGLES, angleUnit, LENGTHS, lengthUnit } from '../state/units';
import { texts } from '../texts';
import { Choice } from './fields';

const distance = signal(2); // which of the steps of the unit
const angle = signal(2);

export function Jog() {
  return (
    <section class="jog" aria-label={texts.jog.label}>
      <h3>{texts.jog.label}</h3>
      <div class="way">
        <Choice label={texts.jog.frame} value={frame.value} options={frames.value.map(named)} onValue={chooseFrame} />
        <span class="vector two">
          <Choice
            label={withUnit(texts.jog.distance, 'm')}
            value={String(distance.value)}
            options={LENGTHS[lengthUnit.value].steps.map(numbered)}
            onValue={(next) => (distance.value = Number(next))}
          />
          <Choice
            label={withUnit(texts.jog.angle, 'rad')}
            value={String(angle.value)}
            options={ANGLES[angleUnit.value].steps.map(numbered)}
            onValue={(next) => (angle.value = Number(next))}
          />
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

function numbered(step: number, index: number): readonly [string, string] {
  return [String(index), String(step)];
}

// While the motion is played only the number changes.
function Axis({ name, axis }: { name: string; axis: number }) {
  const [kind, of] = axis < 3 ? (['shift', axis] as const) : (['turn', axis - 3] as const);
  const shown = useComputed(() => valueOf(axis));
  const step = (sign: number): void => {
    const size = kind === 'shift' ? LENGTHS[lengthUnit.value].steps[distance.value]! : ANGLES[angleUnit.value].steps[angle.value]!;
    jog(kind, of, sign * inService(size, kind === 'shift' ? 'm' : 'rad'));
  };
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
  const [value, unit] = axis < 3 ? [at.position[axis]!, 'm'] : [rpyOfQuaternion(turn)[axis - 3]!, 'rad'];
  return `${decimal(value, unit)} ${shownIn(unit).name}`;
}
