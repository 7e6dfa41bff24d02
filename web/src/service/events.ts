// Server-sent events by fetch, since EventSource sends no API key: https://html.spec.whatwg.org/multipage/server-sent-events.html
import { apiKey, base } from './client';

export interface ServerEvent {
  id: string;
  name: string;
  data: string;
}

// The events in what has been read so far, and the rest, in which one has begun.
export function parsed(text: string): [ServerEvent[], string] {
  const blocks = text.split('\n\n');
  const rest = blocks.pop() ?? '';
  const events = blocks.map((block): ServerEvent => {
    const event = { id: '', name: 'message', data: '' };
    for (const line of block.split('\n')) {
      const [field, value] = [line.slice(0, line.indexOf(':')), line.slice(line.indexOf(':') + 1).replace(/^ /, '')];
      if (field === 'id') event.id = value;
      if (field === 'event') event.name = value;
      if (field === 'data') event.data += event.data === '' ? value : `\n${value}`;
    }
    return event;
  });
  return [events.filter(({ data }) => data !== ''), rest];
}

const AGAIN = 1000; // ms until a broken connection is tried anew, unless the service asks for more

// Hears events until `hear` returns false or the signal aborts; a broken connection goes on where it was.
// Returns the answer where there is no stream of events.
export async function listen(path: string, signal: AbortSignal, hear: (event: ServerEvent) => boolean): Promise<Response | null> {
  let last = '';
  while (!signal.aborted) {
    let pause = AGAIN;
    const headers: Record<string, string> = { Accept: 'text/event-stream' };
    if (apiKey.value !== '') headers.Authorization = `Bearer ${apiKey.value}`;
    if (last !== '') headers['Last-Event-ID'] = last;
    try {
      const answer = await fetch(base + path, { headers, signal });
      if (answer.status >= 500 || answer.status === 429) {
        // as a proxy says while the service is restarted; too many requests
        pause = Math.max(AGAIN, 1000 * Number(answer.headers.get('Retry-After') ?? 0) || 0);
        throw new Error('away');
      }
      if (!answer.ok || !answer.body) return answer;
      const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
      let text = '';
      for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
        const [events, rest] = parsed(text + piece.value);
        text = rest;
        for (const event of events) {
          last = event.id;
          if (!hear(event)) return null;
        }
      }
    } catch {
      // The service is away, or the signal has aborted.
    }
    await new Promise((resolve) => setTimeout(resolve, pause));
  }
  return null;
}
