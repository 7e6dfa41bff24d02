// Checks of JSON values: each returns what is wrong with a value, or null. `at` is the JSON pointer (RFC 6901) of the value.
export type Check = (value: unknown, at: string) => string | null;

type Fields = Readonly<Record<string, Check>>;

function fault(at: string, condition: string, value: unknown): string {
  return `${at === '' ? 'the request' : at} must be ${condition}; got ${shown(value)}`;
}

const LONGEST = 40; // characters of a value that are shown

function shown(value: unknown): string {
  const text = value === undefined ? 'nothing' : JSON.stringify(value);
  return text.length > LONGEST ? `${text.slice(0, LONGEST)} …` : text;
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

export const number: Check = (value, at) =>
  typeof value === 'number' && Number.isFinite(value) ? null : fault(at, 'a finite number', value);

export const flag: Check = (value, at) => (typeof value === 'boolean' ? null : fault(at, 'true or false', value));

export const text: Check = (value, at) => (typeof value === 'string' ? null : fault(at, 'a text', value));

export function matching(pattern: RegExp, condition: string): Check {
  return (value, at) => (typeof value === 'string' && pattern.test(value) ? null : fault(at, condition, value));
}

export function oneOf(...allowed: readonly string[]): Check {
  return (value, at) => (allowed.includes(value as string) ? null : fault(at, `one of ${allowed.join(', ')}`, value));
}

// null is allowed, too.
export function nullable(check: Check): Check {
  return (value, at) => (value === null ? null : check(value, at));
}

export function list(of: Check, { least = 0, most = Infinity }: { least?: number; most?: number } = {}): Check {
  const condition =
    least === most
      ? `a list of length ${least}`
      : `a list${least > 0 ? ` of at least ${least}` : ''}${most < Infinity ? ` and at most ${most}` : ''}`;
  return (value, at) => {
    if (!Array.isArray(value) || value.length < least || value.length > most) return fault(at, condition, value);
    return firstOf(value.map((entry: unknown, index) => () => of(entry, `${at}/${index}`)));
  };
}

// An object that may have more fields than these: the service decides about them.
export function object(required: Fields, optional: Fields = {}): Check {
  return (value, at) => {
    if (!isObject(value)) return fault(at, 'an object', value);
    return (
      firstOf(
        Object.entries(required).map(
          ([name, check]) =>
            () =>
              check(value[name], `${at}/${name}`),
        ),
      ) ??
      firstOf(
        Object.entries(optional).map(
          ([name, check]) =>
            () =>
              value[name] === undefined ? null : check(value[name], `${at}/${name}`),
        ),
      )
    );
  };
}

// An object whose fields are all alike.
export function record(of: Check): Check {
  return (value, at) =>
    isObject(value)
      ? firstOf(
          Object.entries(value).map(
            ([name, entry]) =>
              () =>
                of(entry, `${at}/${escaped(name)}`),
          ),
        )
      : fault(at, 'an object', value);
}

// An object whose `kind` says which fields it has.
export function byKind(kinds: Readonly<Record<string, Check>>): Check {
  const kind = object({ kind: oneOf(...Object.keys(kinds)) });
  return (value, at) => kind(value, at) ?? kinds[(value as { kind: string }).kind]!(value, at);
}

function escaped(name: string): string {
  return name.replaceAll('~', '~0').replaceAll('/', '~1');
}

function firstOf(checks: readonly (() => string | null)[]): string | null {
  for (const check of checks) {
    const found = check();
    if (found !== null) return found;
  }
  return null;
}
