// Fields of forms: a number in the units that a person chose, which is taken when it is finished.
import { useId, useState } from 'preact/hooks';
import { inService, shownIn, withUnit } from '../plan/units';

interface NumberProps {
  label: string;
  title?: string;
  unit?: string; // of the service, in which value, min and max are
  isUnitShown?: boolean;
  value: number | null | undefined; // without one the field is empty
  placeholder?: string;
  min?: number;
  max?: number;
  step?: number | 'any';
  onTyping?: (value: number | undefined) => void; // on the way
  onValue: (value: number | undefined) => void;
}

export function NumberField({
  label,
  title,
  unit = '',
  isUnitShown = true,
  value,
  placeholder,
  min,
  max,
  step = 'any',
  onTyping,
  onValue,
}: NumberProps) {
  const id = useId();
  const { factor, decimals } = shownIn(unit);
  const taken = (input: HTMLInputElement, take: (value: number | undefined) => void): void => {
    if (input.value === '') take(undefined);
    else if (Number.isFinite(input.valueAsNumber)) take(inService(input.valueAsNumber, unit));
  };
  const [typed, setTyped] = useState<string | null>(null); // it stays as it is written until it is finished
  return (
    <span class="field" title={title}>
      <label for={id}>{isUnitShown ? withUnit(label, unit) : label}</label>
      <input
        id={id}
        type="number"
        inputMode="decimal"
        value={typed ?? (value === undefined || value === null ? '' : rounded(value * factor, decimals + FINER))}
        placeholder={placeholder}
        min={min === undefined ? undefined : min * factor}
        max={max === undefined ? undefined : max * factor}
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

const FINER = 2; // decimals that a field has beyond those of a readout: a micrometre, a thousandth of a degree

const NOTHING = 1e-9; // in any unit: what rounding leaves of 0

// Of a number that is smaller than its last decimal, the first three digits.
function rounded(value: number, decimals: number): string {
  if (Math.abs(value) < NOTHING) return '0';
  return String(Number(Math.abs(value) < 10 ** -decimals ? value.toPrecision(3) : value.toFixed(decimals)));
}

interface VectorProps {
  label: string;
  unit?: string; // of the service
  names: readonly string[];
  values: readonly number[];
  onTyping?: (values: number[]) => void;
  onValues: (values: number[]) => void;
}

export function VectorField({ label, unit = '', names, values, onTyping, onValues }: VectorProps) {
  const changed = (index: number, next: number): number[] => values.map((old, i) => (i === index ? next : old));
  return (
    <fieldset class="vector">
      <legend>{withUnit(label, unit)}</legend>
      {values.map((value, index) => (
        <NumberField
          key={names[index]}
          label={names[index]!}
          unit={unit}
          isUnitShown={false}
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
