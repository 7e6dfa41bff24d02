// The request as shown, as code that is ready to paste.
import type { PlanRequest } from '../service/types';

export type Language = 'curl' | 'python' | 'typescript';

export const LANGUAGES: readonly Language[] = ['curl', 'python', 'typescript'];

export function codeOf(language: Language, request: PlanRequest, base: string): string {
  switch (language) {
    case 'curl':
      return `curl -s ${base}/v1/trajectories --json '${json(request).replaceAll("'", "'\\''")}'`;
    case 'python':
      return `import httpx

request = ${python(request)}
answer = httpx.post("${base}/v1/trajectories", json=request, timeout=60)
answer.raise_for_status()
plan = answer.json()
print(plan["duration"], plan["certificate"]["satisfied"])
`;
    case 'typescript':
      return `const request = ${json(request)};

const answer = await fetch('${base}/v1/trajectories', {
  method: 'POST',
  headers: { 'Content-Type': 'application/json' },
  body: JSON.stringify(request),
});
const plan = await answer.json();
if (!answer.ok) throw new Error(plan.detail);
console.log(plan.duration, plan.certificate.satisfied);
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
