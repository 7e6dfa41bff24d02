// A change of a remedy in words: the place in the request, the field and its value with the unit.
import { short } from '../plan/units';

const UNITS: Record<string, string> = {
  duration: 's',
  minimum_duration: 's',
  dwell: 's',
  radius: 'm',
  margin: 'm',
  mass: 'kg',
  tcp_linear_velocity: 'm/s',
  tcp_angular_velocity: 'rad/s',
};
const PLAIN: Record<string, string> = { tcp: 'tool', ik: 'inverse kinematics' };

// The words for a value at a JSON pointer (RFC 6901); `place` names a waypoint as the page does.
export function changeInWords(pointer: string, value: unknown, place: (index: number) => string): string {
  const names = pointer.split('/').slice(1);
  const index = names[0] === 'waypoints' && /^\d+$/.test(names[1] ?? '') ? Number(names[1]) : null;
  const fields = index === null ? names : names.slice(2);
  const unit = UNITS[fields.at(-1) ?? ''];
  const written = valueInWords(value);
  const field = fields.map(wordsOf).join(', ');
  const text = field ? `${field}: ${written}${unit && typeof value === 'number' ? ` ${unit}` : ''}` : written;
  return index === null ? text : `${place(index)}${field ? ', ' : ': '}${text}`;
}

function wordsOf(name: string): string {
  return name
    .split('_')
    .map((word) => PLAIN[word] ?? word)
    .join(' ');
}

function valueInWords(value: unknown): string {
  if (typeof value === 'number') return short(value, 4);
  if (typeof value === 'string') return wordsOf(value);
  if (value === null) return 'none';
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (Array.isArray(value)) return value.map(valueInWords).join(', ');
  return Object.entries(value as object)
    .map(([name, part]) => (name === 'kind' ? valueInWords(part) : `${wordsOf(name)} ${valueInWords(part)}`))
    .join(', ');
}
