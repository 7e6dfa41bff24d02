// The state in the address: a link reproduces what is seen. The request is deflated, so that links stay short.
import type { PlanRequest } from '../service/types';

export interface Shown {
  request: PlanRequest;
  time: number;
}

export async function toFragment({ request, time }: Shown): Promise<string> {
  const text = new Blob([JSON.stringify(request)]).stream().pipeThrough(new CompressionStream('deflate-raw'));
  const bytes = new Uint8Array(await new Response(text).arrayBuffer());
  let binary = '';
  for (const byte of bytes) binary += String.fromCharCode(byte);
  const packed = btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
  return `#r=${packed}${time > 0 ? `&t=${Number(time.toFixed(3))}` : ''}`;
}

// Returns null where the address names no request, or one that cannot be read.
export async function fromFragment(fragment: string): Promise<Shown | null> {
  const fields = new URLSearchParams(fragment.replace(/^#/, ''));
  const packed = fields.get('r');
  if (packed === null) return null;
  try {
    const binary = atob(packed.replaceAll('-', '+').replaceAll('_', '/'));
    const bytes = Uint8Array.from(binary, (letter) => letter.charCodeAt(0));
    const text = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    const request = (await new Response(text).json()) as PlanRequest;
    const time = Number(fields.get('t') ?? 0);
    return isRequest(request) ? { request, time: Number.isFinite(time) ? time : 0 } : null;
  } catch {
    return null;
  }
}

export function isRequest(value: unknown): value is PlanRequest {
  const request = value as Partial<PlanRequest> | null;
  return typeof request === 'object' && typeof request?.robot === 'string' && Array.isArray(request.waypoints);
}
