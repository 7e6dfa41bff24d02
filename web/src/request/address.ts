// The state in the address: a link reproduces what is seen. The request is deflated, so that links stay short.
import type { PlanRequest } from '../service/types';
import { documentOf, showing } from './cells';
import { parseRequest } from './parse';

export interface Shown {
  request: PlanRequest;
  time: number;
}

// A link that holds something else than a request, and why.
export interface Unreadable {
  fault: string;
}

export async function toFragment({ request, time }: Shown): Promise<string> {
  const text = new Blob([JSON.stringify(documentOf(request))]).stream().pipeThrough(new CompressionStream('deflate-raw'));
  const bytes = new Uint8Array(await new Response(text).arrayBuffer());
  let binary = '';
  for (const byte of bytes) binary += String.fromCharCode(byte);
  const packed = btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
  const robot = request.cell?.index ?? 0;
  return `#r=${packed}${robot > 0 ? `&robot=${robot}` : ''}${time > 0 ? `&t=${Number(time.toFixed(3))}` : ''}`;
}

// Reads the fragment of an address; null: it names no request.
export async function fromFragment(fragment: string): Promise<Shown | Unreadable | null> {
  const fields = new URLSearchParams(fragment.replace(/^#/, ''));
  const packed = fields.get('r');
  if (packed === null) return null;
  const time = Number(fields.get('t') ?? 0);
  try {
    const text = await unpacked(packed);
    if (text === null) return { fault: `its request has more than ${MOST_MEGABYTES} MB` };
    const { request, fault } = parseRequest(text);
    if (!request) return { fault };
    return { request: showing(request, Number(fields.get('robot') ?? 0)), time: Number.isFinite(time) ? Math.max(0, time) : 0 };
  } catch {
    return { fault: 'it is cut off or changed' };
  }
}

const MOST_MEGABYTES = 16; // of an unpacked request: a small link can unpack to gigabytes

// Null: the text is longer.
async function unpacked(packed: string): Promise<string | null> {
  const binary = atob(packed.replaceAll('-', '+').replaceAll('_', '/'));
  const bytes = Uint8Array.from(binary, (letter) => letter.charCodeAt(0));
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw')).getReader();
  const decoder = new TextDecoder();
  let [text, size] = ['', 0];
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    size += part.value.length;
    if (size > MOST_MEGABYTES * 1e6) {
      await reader.cancel();
      return null;
    }
    text += decoder.decode(part.value, { stream: true });
  }
  return text + decoder.decode();
}
