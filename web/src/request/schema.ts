// JSON Schemas of the service, as far as forms need them.
import type { Joint } from '../service/types';

export interface Schema {
  $ref?: string;
  type?: string;
  const?: string;
  enum?: readonly string[];
  default?: unknown;
  description?: string;
  properties?: Readonly<Record<string, Schema>>;
  required?: readonly string[];
  items?: Schema;
  minItems?: number;
  maxItems?: number;
  minimum?: number;
  anyOf?: readonly Schema[];
  oneOf?: readonly Schema[];
  additionalProperties?: Schema | boolean;
  name?: string; // of what a reference leads to
}

export type Schemas = Readonly<Record<string, Schema>>;

// Follows references and leaves out null, which a field that is omitted stands for.
export function resolved(schema: Schema, schemas: Schemas): Schema {
  const { $ref, anyOf, description } = schema;
  const parts = anyOf?.filter(({ type }) => type !== 'null');
  if (parts?.length === 1) return { ...resolved(parts[0]!, schemas), ...(description ? { description } : {}) };
  if (!$ref) return schema;
  const name = $ref.replace(/^.*\//, '');
  return { ...resolved(schemas[name]!, schemas), name, ...(description ? { description } : {}) };
}

// The schemas of which a value has one; none: it has this one.
export function alternatives({ oneOf, anyOf }: Schema, schemas: Schemas): Schema[] {
  return [...(oneOf ?? anyOf ?? [])].filter(({ type }) => type !== 'null').map((part) => resolved(part, schemas));
}

// What an alternative is called: its kind, its only value, or its type.
export function nameOf({ properties, const: only, name, type }: Schema): string {
  return properties?.kind?.const ?? only ?? name ?? type ?? '';
}

// Whether a value can be of an alternative.
export function fits(value: unknown, { properties, const: only, type }: Schema): boolean {
  if (only !== undefined) return value === only;
  if (type !== 'object') return typeof value === (type === 'integer' ? 'number' : type);
  const kind = properties?.kind?.const;
  return typeof value === 'object' && value !== null && (kind === undefined || (value as { kind?: unknown }).kind === kind);
}

const UNIT = /[,(] ?(N m|kg m\^2|(?:rad|m|kg|s|N|W)(?:\/s(?:\^\d)?)?)( or (?:m|N)(?:\/s(?:\^\d)?)?)?(?=[.;,:)\s]|$)/;

// The service's unit of a number, which the description names.
export function unitOfField({ description = '' }: Schema, joint?: Joint): string {
  const [, first = '', other = ''] = UNIT.exec(description) ?? [];
  return joint?.kind === 'prismatic' && other ? other.replace(' or ', '') : first;
}

// What is known of the robot when a field is begun.
export interface Around {
  joints: readonly Joint[];
  pose: unknown; // where the tool is
}

const FIRST: Readonly<Record<string, number>> = { kg: 1, s: 1, m: 0.01 }; // by its unit
const POSE = { position: [0, 0, 0], orientation: { kind: 'rpy', rpy: [0, 0, 0] } };

// A first value of a field: what is required of it, no more.
export function initial(name: string, given: Schema, schemas: Schemas, around: Around): unknown {
  const schema = resolved(given, schemas);
  const [one] = alternatives(schema, schemas);
  if (one) return initial(name, one, schemas, around);
  if (schema.const !== undefined || schema.default !== undefined) return schema.const ?? schema.default;
  if (schema.name === 'Pose') return name === 'via' || name === 'poses' ? around.pose : POSE;
  const inner = (key: string, of: Schema): unknown => initial(key, of, schemas, around);
  switch (schema.type) {
    case 'object':
      return Object.fromEntries((schema.required ?? []).map((key) => [key, inner(key, schema.properties![key]!)]));
    case 'array':
      if (isOfJoints(schema)) return around.joints.map((joint) => ofJoint(name, joint, schema.items!));
      return Array.from({ length: schema.minItems ?? 0 }, () => inner(name, schema.items!));
    case 'boolean':
      return true;
    case 'string':
      return schema.enum?.[0] ?? name;
    default:
      return Math.max(schema.minimum ?? 0, FIRST[unitOfField(schema)] ?? 0);
  }
}

// Whether a list has one number, or one range, for each joint.
export function isOfJoints({ items, minItems, maxItems }: Schema): boolean {
  const one = items?.type === 'array' && items.maxItems === 2 ? items.items : items;
  return (one?.type === 'number' || one?.type === 'integer') && (minItems === undefined || minItems !== maxItems);
}

function ofJoint(name: string, joint: Joint, { type }: Schema): unknown {
  const quantity = name.replace(/_range$/, '') as 'velocity';
  const own = (joint as Partial<Joint>)[quantity] ?? (type === 'array' ? 1 : 0);
  return type === 'array' ? [-own, own] : own;
}
