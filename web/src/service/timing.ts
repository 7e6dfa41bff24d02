// How long the service took, by its Server-Timing header: https://www.w3.org/TR/server-timing/

// The durations in such a header by their names, s.
export function timings(header: string | null): Map<string, number> {
  const entries = (header ?? '').split(',').map((entry): [string, number] => {
    const [name, ...parameters] = entry.split(';').map((part) => part.trim());
    const duration = parameters.find((parameter) => parameter.startsWith('dur='));
    return [name!, Number(duration?.slice('dur='.length)) / 1000];
  });
  return new Map(entries.filter(([, duration]) => Number.isFinite(duration)));
}
