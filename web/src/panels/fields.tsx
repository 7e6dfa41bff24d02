// Fields of forms: a number in the units of people that is taken when it is finished.
import { useId } from 'preact/hooks';

interface NumberProps {
  label: string;
  value: number | undefined; // undefined: the field is empty
  placeholder?: string;
  min?: number;
  max?: number;
  step?: number | 'any';
  onValue: (value: number | undefined) => void;
}

export function NumberField({ label, value, placeholder, min, max, step = 'any', onValue }: NumberProps) {
  const id = useId();
  return (
    <span class="field">
      <label for={id}>{label}</label>
      <input
        id={id}
        type="number"
        inputMode="decimal"
        value={value === undefined ? '' : rounded(value)}
        placeholder={placeholder}
        min={min}
        max={max}
        step={step}
        onChange={(event) => taken(event.currentTarget, onValue)}
      />
    </span>
  );
}

function taken(input: HTMLInputElement, onValue: (value: number | undefined) => void): void {
  if (input.value === '') onValue(undefined);
  else if (Number.isFinite(input.valueAsNumber)) onValue(input.valueAsNumber);
}

// As many digits as a person wants to see: a micrometre, a thousandth of a degree.
function rounded(value: number): string {
  return String(Number(value.toFixed(3)));
}

interface VectorProps {
  label: string;
  names: readonly string[];
  values: readonly number[];
  onValues: (values: number[]) => void;
}

export function VectorField({ label, names, values, onValues }: VectorProps) {
  return (
    <fieldset class="vector">
      <legend>{label}</legend>
      {values.map((value, index) => (
        <NumberField
          key={names[index]}
          label={names[index]!}
          value={value}
          onValue={(next) => {
            if (next !== undefined) onValues(values.map((old, i) => (i === index ? next : old)));
          }}
        />
      ))}
    </fieldset>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  value: T;
  options: readonly (readonly [T, string])[];
  onValue: (value: T) => void;
}

export function Choice<T extends string>({ label, value, options, onValue }: ChoiceProps<T>) {
  const id = useId();
  return (
    <span class="field">
      <label for={id}>{label}</label>
      <select id={id} value={value} onChange={(event) => onValue(event.currentTarget.value as T)}>
        {options.map(([name, text]) => (
          <option key={name} value={name}>
            {text}
          </option>
        ))}
      </select>
    </span>
  );
}
