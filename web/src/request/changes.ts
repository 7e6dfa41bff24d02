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
  return `${fieldInWords(pointer, place)}: ${valueInWords(value, pointer.split('/').at(-1))}`;
}

// The words for a field at a JSON pointer.
export function fieldInWords(pointer: string, place: (index: number) => string): string {
  const names = pointer.replace(OF_ROBOT, '').split('/').slice(1);
  const isOfWaypoint = names[0] === 'waypoints' && /^\d+$/.test(names[1] ?? '');
  const fields = isOfWaypoint ? names.slice(2) : names;
  return [...(isOfWaypoint ? [place(Number(names[1]))] : []), ...fields.map(wordsOf)].join(', ');
}

// The JSON pointer of a field that is written as in Python: `waypoints[1].duration`.
export function pointerOf(name: string): string {
  return `/${name.replaceAll(/\[(\d+)\]/g, '.$1').replaceAll('.', '/')}`;
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
