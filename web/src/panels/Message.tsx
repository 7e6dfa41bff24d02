// What the service says, in the language of the page; its own text is behind a disclosure.
import { messageOf } from '../request/messages';
import type { Problem } from '../service/types';
import { robot } from '../state/store';
import { texts } from '../texts';

// The sentences of a problem; its title stands elsewhere.
export function ProblemText({ problem }: { problem: Problem }) {
  const { sentences, original } = messageOf(problem, robot.value?.joints);
  const faults = (problem.errors ?? []).map(({ pointer, message }) => `${pointer || '/'}: ${message}`);
  const isOwn = original.length === 0;
  return (
    <>
      <p>{[...sentences, ...(isOwn ? faults.slice(1) : [])].join(' ')}</p>
      <Original texts={isOwn ? [] : [...original, ...faults]} />
    </>
  );
}

export function Original({ texts: given }: { texts: readonly string[] }) {
  if (given.length === 0) return null;
  return (
    <details class="original">
      <summary>{texts.messages.original}</summary>
      {given.map((text) => (
        <p key={text} lang="en">
          {text}
        </p>
      ))}
    </details>
  );
}
