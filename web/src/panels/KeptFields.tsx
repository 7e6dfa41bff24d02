// What the tool keeps on a free motion: the form of each constraint, with a drawing on the stage.
import { CONSTRAINTS, firstConstraint, keeping, MOST_CONSTRAINTS } from '../request/kept';
import { quaternionOf } from '../request/rotations';
import type { FreeMotion, Pose, PoseConstraint } from '../service/types';
import { texts } from '../texts';
import { Choice, NumberField, VectorField } from './fields';
import { PoseFields, TurnFields } from './PoseFields';

interface KeptProps {
  motion: FreeMotion;
  ends: () => readonly Pose[]; // of the motion, in the base frame
  change: (motion: FreeMotion) => void;
}

export function KeptFields({ motion, ends, change }: KeptProps) {
  const constraints = motion.keep ?? [];
  const kept = (next: readonly PoseConstraint[]): void => change(keeping(motion, next));
  const put = (index: number, next: PoseConstraint): void => kept(constraints.map((old, i) => (i === index ? next : old)));
  return (
    <div class="kept">
      {constraints.map((constraint, index) => (
        <fieldset key={index} class="group">
          <legend>
            {texts.kept.number(index)}
            <button
              type="button"
              class="remove"
              aria-label={texts.kept.remove(index)}
              title={texts.kept.remove(index)}
              onClick={() => kept(constraints.filter((_, i) => i !== index))}
            >
              ✕
            </button>
          </legend>
          <Choice
            label={texts.kept.kind}
            value={constraint.kind}
            options={CONSTRAINTS.map((kind) => [kind, texts.kept.kinds[kind]] as const)}
            onValue={(kind) => put(index, firstConstraint(kind, ends()))}
          />
          <p class="hint">{texts.kept.meanings[constraint.kind]}</p>
          <Fields constraint={constraint} onValue={(next) => put(index, next)} />
        </fieldset>
      ))}
      {constraints.length < MOST_CONSTRAINTS && (
        <button type="button" class="begin" onClick={() => kept([...constraints, firstConstraint('tool_axis', ends())])}>
          {texts.kept.add}
        </button>
      )}
    </div>
  );
}

interface FieldsProps {
  constraint: PoseConstraint;
  onValue: (constraint: PoseConstraint) => void;
}

const AXES = ['x', 'y', 'z'];
const BASE_AXES: NonNullable<Pose['orientation']> = { kind: 'rpy', rpy: [0, 0, 0] }; // of a box without an orientation

function Fields({ constraint, onValue }: FieldsProps) {
  const vector = (name: string, values: readonly number[], unit = '') => (
    <VectorField
      label={texts.kept.fields[name]!}
      unit={unit}
      names={AXES}
      values={values}
      onValues={(next) => isVector(name, next) && onValue({ ...constraint, [name]: next })}
    />
  );
  const number = (name: string, value: number, unit: string, min?: number) => (
    <NumberField
      label={texts.kept.fields[name]!}
      unit={unit}
      value={value}
      min={min}
      onValue={(next) => next !== undefined && onValue({ ...constraint, [name]: next })}
    />
  );
  switch (constraint.kind) {
    case 'tool_axis':
      return (
        <>
          {vector('axis', constraint.axis ?? [0, 0, 1])}
          {vector('direction', constraint.direction)}
          {number('angle', constraint.angle, 'rad', 0)}
        </>
      );
    case 'orientation':
      return (
        <>
          <TurnFields
            turn={quaternionOf(constraint.orientation)!}
            onTurn={(xyzw) => onValue({ ...constraint, orientation: { kind: 'quaternion', xyzw } })}
          />
          {number('angle', constraint.angle, 'rad', 0)}
        </>
      );
    case 'box':
      return (
        <>
          <PoseFields
            pose={{ ...constraint.pose, orientation: constraint.pose.orientation ?? BASE_AXES }}
            onPose={(pose) => onValue({ ...constraint, pose })}
          />
          {vector('size', constraint.size, 'm')}
        </>
      );
    case 'half_space':
      return (
        <>
          {vector('normal', constraint.normal)}
          {number('offset', constraint.offset, 'm')}
        </>
      );
    case 'plane':
      return (
        <>
          {vector('point', constraint.point, 'm')}
          {vector('normal', constraint.normal)}
          {number('distance', constraint.distance, 'm', 0)}
        </>
      );
    case 'line':
      return (
        <>
          {vector('point', constraint.point, 'm')}
          {vector('direction', constraint.direction)}
          {number('distance', constraint.distance, 'm', 0)}
        </>
      );
  }
}

// A direction has some length; a point and a size may be anything here, and the service decides about them.
function isVector(name: string, values: readonly number[]): boolean {
  return name === 'point' || name === 'size' || values.some((value) => value !== 0);
}
