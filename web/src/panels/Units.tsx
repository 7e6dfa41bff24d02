// The choice of the units in which the page shows lengths and angles.
import { ANGLES, angleUnit, chooseAngle, chooseLength, LENGTHS, lengthUnit } from '../state/units';
import { texts } from '../texts';

export function Units() {
  return (
    <span class="buttons units">
      <Choice label={texts.units.length} units={LENGTHS} value={lengthUnit.value} onChoose={chooseLength} />
      <Choice label={texts.units.angle} units={ANGLES} value={angleUnit.value} onChoose={chooseAngle} />
    </span>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  units: Readonly<Record<T, object>>;
  value: T;
  onChoose: (unit: T) => void;
}

function Choice<T extends keyof typeof texts.units.names>({ label, units, value, onChoose }: ChoiceProps<T>) {
  return (
    <select aria-label={label} title={label} value={value} onChange={(event) => onChoose(event.currentTarget.value as T)}>
      {(Object.keys(units) as T[]).map((unit) => (
        <option key={unit} value={unit}>
          {texts.units.names[unit]}
        </option>
      ))}
    </select>
  );
}
