// The request as JSON: read it, change it, open and save it.
import { useState } from 'preact/hooks';
import { isRequest } from '../request/address';
import { json } from '../request/code';
import { show } from '../state/actions';
import { request } from '../state/store';
import { texts } from '../texts';
import { save } from './save';

export function RequestJson() {
  const [edited, setEdited] = useState<string | null>(null);
  const [wrong, setWrong] = useState('');
  const text = edited ?? json(request.value);
  const take = (next: string): void => {
    const fault = taken(next);
    setWrong(fault);
    setEdited(fault === '' ? null : next);
  };
  return (
    <div class="json">
      <label for="request-json">{texts.json.label}</label>
      <textarea id="request-json" rows={18} spellcheck={false} value={text} onInput={(event) => setEdited(event.currentTarget.value)} />
      {wrong !== '' && (
        <p role="alert" class="wrong-text">
          {texts.json.wrong} {wrong}
        </p>
      )}
      <div class="buttons">
        <button type="button" class="primary" onClick={() => take(text)}>
          {texts.json.apply}
        </button>
        <button type="button" onClick={() => save(`${request.value?.robot ?? 'request'}.json`, new Blob([json(request.value)]))}>
          {texts.json.save}
        </button>
        <label class="file">
          {texts.json.open}
          <input type="file" accept=".json,application/json" onChange={(event) => void open(event.currentTarget).then(take)} />
        </label>
      </div>
    </div>
  );
}

async function open(input: HTMLInputElement): Promise<string> {
  return (await input.files?.[0]?.text()) ?? '';
}

// Shows a request; returns what is wrong with the text, if anything.
function taken(text: string): string {
  try {
    const next: unknown = JSON.parse(text);
    if (!isRequest(next)) return texts.json.noRequest;
    show(next, texts.said.imported);
    return '';
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}
