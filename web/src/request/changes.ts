// A change of a remedy in words: the place in the request, the field and its value with the unit.
import { short, written } from '../plan/units';
import { texts } from '../texts';

const UNITS: Record<string, string> = {
  duration: 's',
  minimum_duration: 's',
  earliest_arrival: 's',
  latest_arrival: 's',
  dwell: 's',
  radius: 'm',
  margin: 'm',
  clearance: 'm',
  speed: 'm/s',
  mass: 'kg',
  tcp_linear_velocity: 'm/s',
  tcp_angular_velocity: 'rad/s',
};

const OF_ROBOT = /^\/robots\/\d+/; // of a cell

// The words for a value at a JSON pointer (RFC 6901); `place` names a waypoint as the page does.
export function changeInWords(pointer: string, value: unknown, place: (index: number) => string): string {
  const names = pointer.replace(OF_ROBOT, '').split('/').slice(1);
  const index = names[0] === 'waypoints' && /^\d+$/.test(names[1] ?? '') ? Number(names[1]) : null;
  const fields = index === null ? names : names.slice(2);
  const words = valueInWords(value, fields.at(-1));
  const field = fields.map(wordsOf).join(', ');
  const text = field ? `${field}: ${words}` : words;
  return index === null ? text : `${place(index)}${field ? ', ' : ': '}${text}`;
}

function wordsOf(name: string): string {
  const { words } = texts.messages;
  const parts = name.split('_').map((word) => words[word] ?? word);
  return words[name] ?? parts.join(' ');
}

// The field has the unit of a number.
function valueInWords(value: unknown, field = ''): string {
  if (typeof value === 'number') return field in UNITS ? written(value, UNITS[field]!) : short(value);
  if (typeof value === 'string') return wordsOf(value);
  if (value === null || typeof value === 'boolean') return wordsOf(String(value));
  if (Array.isArray(value)) return value.map((part) => valueInWords(part)).join(', ');
  return Object.entries(value as object)
    .map(([name, part]) => (name === 'kind' ? valueInWords(part) : `${wordsOf(name)} ${valueInWords(part, name)}`))
    .join(', ');
}
