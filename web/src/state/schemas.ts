// The service's own description of its fields, loaded when somebody wants to see a form of them.
import { signal } from '@preact/signals';
import type { Schemas } from '../request/schema';
import { base } from '../service/client';

export const schemas = signal<Schemas | null>(null);

let loading: Promise<void> | null = null;

export function loadSchemas(): void {
  loading ??= load().catch(() => {
    loading = null; // the next one who looks tries again
  });
}

async function load(): Promise<void> {
  const answer = await fetch(`${base}/openapi.json`);
  const { components } = (await answer.json()) as { components: { schemas: Schemas } };
  schemas.value = components.schemas;
}
