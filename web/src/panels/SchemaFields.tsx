// A form of all fields that the service describes, in the units of people.
import { useState } from 'preact/hooks';
import { withoutEmpty } from '../request/edits';
import { alternatives, fits, initial, isOfJoints, nameOf, resolved, unitOfField } from '../request/schema';
import type { Around, Schema, Schemas } from '../request/schema';
import type { Joint, Pose } from '../service/types';
import { texts } from '../texts';
import { Choice, NumberField, TextField, VectorField } from './fields';
import { PoseFields } from './PoseFields';
import { isSimple, labelOf, Simple, wordOf } from './SimpleField';

export interface Forms extends Around {
  schemas: Schemas;
}

interface ObjectProps {
  schema: Schema;
  value: object;
  skip?: readonly string[];
  forms: Forms;
  onValue: (value: object) => void;
}

// The fields of an object, but for its kind and those that stand elsewhere.
export function ObjectFields({ schema, value, skip = [], forms, onValue }: ObjectProps) {
  const fields = Object.entries(schema.properties ?? {}).filter(([name]) => name !== 'kind' && !skip.includes(name));
  return (
    <>
      {fields.map(([name, field]) => (
        <Field
          key={name}
          name={name}
          schema={field}
          value={(value as Record<string, unknown>)[name] ?? undefined}
          isRequired={schema.required?.includes(name) ?? false}
          forms={forms}
          onValue={(next) => onValue(withoutEmpty({ ...value, [name]: next }))}
        />
      ))}
    </>
  );
}

interface FieldProps {
  name: string;
  schema: Schema;
  value: unknown; // undefined: it is omitted
  isRequired: boolean;
  forms: Forms;
  onValue: (value: unknown) => void;
}

function Field({ name, schema: given, value, isRequired, forms, onValue }: FieldProps) {
  const schema = { ...resolved(given, forms.schemas), ...(given.default === undefined ? {} : { default: given.default }) };
  const label = labelOf(name);
  const title = schema.description;
  if (isSimple(schema)) return <Simple {...{ label, title, schema, value, isRequired, onValue }} />;
  if (value === undefined)
    return (
      <button type="button" class="begin" title={title} onClick={() => onValue(initial(name, given, forms.schemas, forms))}>
        + {label}
      </button>
    );
  return (
    <fieldset class="group" title={title}>
      <legend>
        {label}
        {!isRequired && <Remove label={label} onRemove={() => onValue(undefined)} />}
      </legend>
      <Composite name={name} schema={schema} value={value} forms={forms} onValue={onValue} />
    </fieldset>
  );
}

function Remove({ label, onRemove }: { label: string; onRemove: () => void }) {
  return (
    <button type="button" class="remove" aria-label={texts.fields.remove(label)} title={texts.fields.remove(label)} onClick={onRemove}>
      ✕
    </button>
  );
}

interface CompositeProps {
  name: string;
  schema: Schema;
  value: unknown;
  forms: Forms;
  onValue: (value: unknown) => void;
}

function Composite({ name, schema, value, forms, onValue }: CompositeProps) {
  const parts = alternatives(schema, forms.schemas);
  if (parts.length > 0) return <Alternatives {...{ name, schema, parts, value, forms, onValue }} />;
  if (schema.name === 'Pose') return <PoseFields pose={value as Pose} onPose={onValue} />;
  if (schema.type === 'array') return <List {...{ name, schema, value, forms, onValue }} />;
  if (typeof schema.additionalProperties === 'object') return <Named {...{ name, schema, value, forms, onValue }} />;
  return <ObjectFields schema={schema} value={value as object} forms={forms} onValue={onValue} />;
}

function Alternatives({ name, schema, parts, value, forms, onValue }: CompositeProps & { parts: readonly Schema[] }) {
  const chosen = parts.find((part) => fits(value, part)) ?? parts[0]!;
  const described = { ...chosen, description: schema.description ?? chosen.description };
  const choose = (next: string): void => {
    const part = parts.find((other) => nameOf(other) === next)!;
    onValue(initial(name, part, forms.schemas, forms));
  };
  return (
    <>
      <Choice
        label={texts.fields.kind}
        value={nameOf(chosen)}
        options={parts.map((part) => [nameOf(part), wordOf(nameOf(part))] as const)}
        onValue={choose}
      />
      {chosen.const === undefined &&
        (isSimple(chosen) ? (
          <Simple label={labelOf(name)} title={undefined} schema={described} value={value} isRequired onValue={onValue} />
        ) : (
          <Composite name={name} schema={described} value={value} forms={forms} onValue={onValue} />
        ))}
    </>
  );
}

const MOST_ITEMS = 24; // of a list that has a form
const AXES = ['x', 'y', 'z', 'w'];

function List({ name, schema, value, forms, onValue }: CompositeProps) {
  const items = value as unknown[];
  const item = resolved(schema.items!, forms.schemas);
  const put = (index: number, next: unknown): void => onValue(items.map((old, i) => (i === index ? next : old)));
  if (items.length > MOST_ITEMS) return <p class="hint">{texts.fields.many(items.length)}</p>;
  if (isOfJoints(schema)) {
    return (
      <>
        {items.map((one, index) => (
          <OfJoint key={index} schema={schema} value={one} joint={forms.joints[index]} onValue={(next) => put(index, next)} />
        ))}
      </>
    );
  }
  if (item.type === 'number')
    return <Numbers schema={schema} names={items.length === 2 ? texts.fields.range : AXES} value={value} onValue={onValue} />;
  return (
    <>
      {items.map((one, index) => (
        <fieldset key={index} class="group">
          <legend>
            {index}
            {items.length > (schema.minItems ?? 0) && (
              <Remove label={`${labelOf(name)} ${index}`} onRemove={() => onValue(items.filter((_, i) => i !== index))} />
            )}
          </legend>
          {isSimple(item) ? (
            <Simple label={labelOf(name)} title={undefined} schema={item} value={one} isRequired onValue={(next) => put(index, next)} />
          ) : (
            <Composite name={name} schema={item} value={one} forms={forms} onValue={(next) => put(index, next)} />
          )}
        </fieldset>
      ))}
      <button type="button" class="begin" onClick={() => onValue([...items, initial(name, schema.items!, forms.schemas, forms)])}>
        + {texts.fields.another}
      </button>
    </>
  );
}

function Numbers({
  schema,
  names,
  value,
  onValue,
}: {
  schema: Schema;
  names: readonly string[];
  value: unknown;
  onValue: (value: number[]) => void;
}) {
  return <VectorField label="" unit={unitOfField(schema)} names={names} values={value as number[]} onValues={onValue} />;
}

// The number or the range of one joint.
function OfJoint({
  schema,
  value,
  joint,
  onValue,
}: {
  schema: Schema;
  value: unknown;
  joint: Joint | undefined;
  onValue: (value: unknown) => void;
}) {
  const [unit, label] = [unitOfField(schema, joint), joint?.name ?? ''];
  if (Array.isArray(value))
    return <VectorField label={label} unit={unit} names={texts.fields.range} values={value as number[]} onValues={onValue} />;
  return <NumberField label={label} unit={unit} value={value as number} onValue={(next) => next !== undefined && onValue(next)} />;
}

// Values by names of the person's own.
function Named({ name, schema, value, forms, onValue }: CompositeProps) {
  const [next, setNext] = useState('');
  const entries = Object.entries(value as Record<string, unknown>);
  const item = schema.additionalProperties as Schema;
  return (
    <>
      {entries.map(([key, one]) => (
        <fieldset key={key} class="group">
          <legend>
            {key}
            <Remove label={key} onRemove={() => onValue(Object.fromEntries(entries.filter(([other]) => other !== key)))} />
          </legend>
          <Composite
            name={name}
            schema={resolved(item, forms.schemas)}
            value={one}
            forms={forms}
            onValue={(changed) => onValue({ ...(value as object), [key]: changed })}
          />
        </fieldset>
      ))}
      <TextField label={texts.fields.name} value={next} onValue={setNext} />
      <button
        type="button"
        class="begin"
        disabled={next === ''}
        onClick={() => {
          onValue({ ...(value as object), [next]: initial(name, item, forms.schemas, forms) });
          setNext('');
        }}
      >
        + {texts.fields.another}
      </button>
    </>
  );
}
