// The request as shown, as code that is ready to paste.
import type { PlanRequest } from '../service/types';
import { documentOf } from './cells';

export type Language = 'curl' | 'python' | 'typescript';

export const LANGUAGES: readonly Language[] = ['curl', 'python', 'typescript'];

// The address at which the service plans the request, or its cell.
export function addressOf(request: PlanRequest): '/v1/trajectories' | '/v1/cells/plan' {
  return request.cell ? '/v1/cells/plan' : '/v1/trajectories';
}

export function codeOf(language: Language, shown: PlanRequest, base: string): string {
  const request = documentOf(shown);
  const address = base + addressOf(shown);
  switch (language) {
    case 'curl':
      return `curl -s ${address} --json '${json(request).replaceAll("'", "'\\''")}'`;
    case 'python':
      return `import httpx

request = ${python(request)}
answer = httpx.post("${address}", json=request, timeout=60)
answer.raise_for_status()
plan = answer.json()
print(plan["duration"], plan${shown.cell ? '["clearances"]' : '["certificate"]["satisfied"]'})
`;
    case 'typescript':
      return `const request = ${json(request)};

const answer = await fetch('${address}', {
  method: 'POST',
  headers: { 'Content-Type': 'application/json' },
  body: JSON.stringify(request),
});
const plan = await answer.json();
if (!answer.ok) throw new Error(plan.detail);
console.log(plan.duration, plan.${shown.cell ? 'clearances' : 'certificate.satisfied'});
`;
  }
}

// JSON with rows of numbers on one line.
export function json(value: unknown): string {
  return JSON.stringify(value, null, 2).replace(/\[\s+((?:-?[\d.eE+-]+,?\s*)+)\]/g, (_, numbers: string) => {
    return `[${numbers.trim().replace(/,\s+/g, ', ')}]`;
  });
}

// A Python literal: JSON but for three names.
function python(value: unknown): string {
  const strings: string[] = [];
  const without = json(value).replace(/"(?:[^"\\]|\\.)*"/g, (text) => `"${strings.push(text) - 1}"`);
  const names = without
    .replace(/\btrue\b/g, 'True')
    .replace(/\bfalse\b/g, 'False')
    .replace(/\bnull\b/g, 'None');
  return names.replace(/"(\d+)"/g, (_, index: string) => strings[Number(index)]!);
}
