// Fields of forms: a number in the units of people that is taken when it is finished.
import { useId, useState } from 'preact/hooks';

interface NumberProps {
  label: string;
  title?: string;
  value: number | undefined; // undefined: the field is empty
  placeholder?: string;
  min?: number;
  max?: number;
  step?: number | 'any';
  onTyping?: (value: number | undefined) => void; // on the way
  onValue: (value: number | undefined) => void;
}

export function NumberField({ label, title, value, placeholder, min, max, step = 'any', onTyping, onValue }: NumberProps) {
  const id = useId();
  const [typed, setTyped] = useState<string | null>(null); // it stays as it is written until it is finished
  return (
    <span class="field" title={title}>
      <label for={id}>{label}</label>
      <input
        id={id}
        type="number"
        inputMode="decimal"
        value={typed ?? (value === undefined ? '' : rounded(value))}
        placeholder={placeholder}
        min={min}
        max={max}
        step={step}
        onInput={(event) => {
          setTyped(event.currentTarget.value);
          if (onTyping) taken(event.currentTarget, onTyping);
        }}
        onChange={(event) => {
          setTyped(null);
          taken(event.currentTarget, onValue);
        }}
        onBlur={() => setTyped(null)}
      />
    </span>
  );
}

function taken(input: HTMLInputElement, onValue: (value: number | undefined) => void): void {
  if (input.value === '') onValue(undefined);
  else if (Number.isFinite(input.valueAsNumber)) onValue(input.valueAsNumber);
}

// As many digits as a person wants to see: a micrometre, a thousandth of a degree; of less the first three.
function rounded(value: number): string {
  return String(Number(Math.abs(value) < 1e-3 ? value.toPrecision(3) : value.toFixed(3)));
}

interface VectorProps {
  label: string;
  names: readonly string[];
  values: readonly number[];
  onTyping?: (values: number[]) => void;
  onValues: (values: number[]) => void;
}

export function VectorField({ label, names, values, onTyping, onValues }: VectorProps) {
  const changed = (index: number, next: number): number[] => values.map((old, i) => (i === index ? next : old));
  return (
    <fieldset class="vector">
      <legend>{label}</legend>
      {values.map((value, index) => (
        <NumberField
          key={names[index]}
          label={names[index]!}
          value={value}
          onTyping={onTyping && ((next) => next !== undefined && onTyping(changed(index, next)))}
          onValue={(next) => next !== undefined && onValues(changed(index, next))}
        />
      ))}
    </fieldset>
  );
}

interface TextProps {
  label: string;
  title?: string;
  value: string;
  onValue: (value: string) => void;
}

export function TextField({ label, title, value, onValue }: TextProps) {
  const id = useId();
  return (
    <span class="field" title={title}>
      <label for={id}>{label}</label>
      <input id={id} value={value} onChange={(event) => onValue(event.currentTarget.value)} />
    </span>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  title?: string;
  value: T;
  options: readonly (readonly [T, string])[];
  onValue: (value: T) => void;
}

export function Choice<T extends string>({ label, title, value, options, onValue }: ChoiceProps<T>) {
  const id = useId();
  return (
    <span class="field" title={title}>
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
