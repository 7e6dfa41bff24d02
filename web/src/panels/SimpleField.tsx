// A field that holds a number, a text, yes or no, or one of several words.
import { short, shownIn } from '../plan/units';
import { unitOfField } from '../request/schema';
import type { Schema } from '../request/schema';
import { texts } from '../texts';
import { Choice, NumberField, TextField } from './fields';

export function isSimple({ type, oneOf, anyOf, enum: values }: Schema): boolean {
  return !oneOf && !anyOf && (values !== undefined || ['number', 'integer', 'boolean', 'string'].includes(type ?? ''));
}

interface SimpleProps {
  label: string;
  title: string | undefined;
  schema: Schema;
  value: unknown;
  isRequired: boolean;
  onValue: (value: unknown) => void;
}

export function Simple({ label, title, schema, value, isRequired, onValue }: SimpleProps) {
  if (schema.type === 'boolean' || schema.enum) {
    const names = schema.enum ?? ['true', 'false'];
    const usual = `${texts.fields.usual}${typeof schema.default === 'string' ? ` (${wordOf(schema.default)})` : ''}`;
    const options = [...(isRequired ? [] : [['', usual] as const]), ...names.map((one) => [one, wordOf(one)] as const)];
    const take = (next: string): void => onValue(next === '' ? undefined : schema.enum ? next : next === 'true');
    return (
      <Choice
        label={label}
        title={title}
        value={typeof value === 'boolean' || typeof value === 'string' ? String(value) : ''}
        options={options}
        onValue={take}
      />
    );
  }
  if (schema.type === 'string') {
    return (
      <TextField
        label={label}
        title={title}
        value={typeof value === 'string' ? value : ''}
        onValue={(next) => onValue(next === '' ? undefined : next)}
      />
    );
  }
  const unit = unitOfField(schema);
  return (
    <NumberField
      label={label}
      title={title}
      unit={unit}
      value={typeof value === 'number' ? value : undefined}
      placeholder={typeof schema.default === 'number' ? short(schema.default * shownIn(unit).factor) : texts.editor.none}
      onValue={(next) => (next !== undefined || !isRequired) && onValue(next)}
    />
  );
}

export function wordOf(name: string): string {
  return texts.fields.words[name] ?? name.replaceAll('_', ' ');
}

export function labelOf(name: string): string {
  const text = wordOf(name).replace(/^tcp /, 'TCP ');
  return text.charAt(0).toUpperCase() + text.slice(1);
}
