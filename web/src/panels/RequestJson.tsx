// The request as JSON: read it, change it, open and save it.
import { useState } from 'preact/hooks';
import { documentOf, showing } from '../request/cells';
import { json } from '../request/code';
import { parseRequest, tasksOf } from '../request/parse';
import type { PlanRequest } from '../service/types';
import { openRequest, show } from '../state/actions';
import { openTasks } from '../state/ordering';
import { request } from '../state/store';
import { texts } from '../texts';
import { Projects } from './Projects';
import { save } from './save';

// A text that is not yet a request, what is wrong with it, and the request that it was made from.
interface Draft {
  of: PlanRequest | null;
  text: string;
  fault: string;
}

export function RequestJson() {
  const [kept, setDraft] = useState<Draft | null>(null);
  const shown = request.value;
  const draft = kept?.of === shown ? kept : null; // another request has taken its place
  const written = json(shown && documentOf(shown));
  const text = draft?.text ?? written;
  const take = (next: string, use: (request: PlanRequest) => void): void => {
    const tasks = tasksOf(next);
    if (tasks) return void openTasks(tasks);
    const { request: parsed, fault } = parseRequest(next);
    setDraft(parsed ? null : { of: shown, text: next, fault });
    if (parsed) use(parsed);
  };
  return (
    <div class="json">
      <label for="request-json">{texts.json.label}</label>
      <textarea
        id="request-json"
        rows={18}
        spellcheck={false}
        value={text}
        onInput={(event) => setDraft({ of: shown, text: event.currentTarget.value, fault: '' })}
      />
      {draft?.fault && (
        <p role="alert" class="wrong-text">
          {texts.json.wrong} {draft.fault}
        </p>
      )}
      <div class="buttons">
        <button
          type="button"
          class="primary"
          onClick={() => take(text, (parsed) => show(showing(parsed, shown?.cell?.index ?? 0), texts.said.imported))}
        >
          {texts.json.apply}
        </button>
        <button type="button" onClick={() => save(`${shown?.cell ? 'cell' : (shown?.robot ?? 'request')}.json`, new Blob([written]))}>
          {texts.json.save}
        </button>
        <label class="file">
          {texts.json.open}
          <input
            type="file"
            accept=".json,application/json"
            onChange={(event) =>
              void open(event.currentTarget).then((file) => take(file, (parsed) => openRequest(parsed, texts.said.imported)))
            }
          />
        </label>
      </div>
      <Projects />
    </div>
  );
}

async function open(input: HTMLInputElement): Promise<string> {
  return (await input.files?.[0]?.text()) ?? '';
}
