// The top of the page: robot, example, back end, plan, undo and redo.
import type { Backend } from '../service/types';
import { EXAMPLES } from '../request/examples';
import type { Example } from '../request/examples';
import { apiKey, useKey } from '../service/client';
import { chooseExample, chooseRobot, redo, settle, show, undo } from '../state/actions';
import { planNow } from '../state/planning';
import { backends, history, notice, planning, problem, request, robots } from '../state/store';
import { switchTheme } from '../state/theme';
import { texts } from '../texts';

const GROUPS: readonly Example['group'][] = ['documents', 'jobs', 'features'];

export function Header() {
  const shown = request.value;
  return (
    <header class="header">
      <a class="skip" href="#waypoints" onClick={skip}>
        {texts.skip}
      </a>
      <h1>{texts.title}</h1>
      <span class="labelled">
        <label for="robot">{texts.header.robot}</label>
        <select id="robot" value={shown?.robot ?? ''} onChange={(event) => void chooseRobot(event.currentTarget.value)}>
          {robotIds(shown?.robot).map((id) => (
            <option key={id} value={id}>
              {id}
            </option>
          ))}
        </select>
      </span>
      <span class="labelled">
        <label for="example" class="visually-hidden">
          {texts.header.example}
        </label>
        <select id="example" value="" onChange={(event) => openExample(event.currentTarget)}>
          <option value="">{texts.header.chooseExample}</option>
          {GROUPS.map((group) => (
            <optgroup key={group} label={texts.header.groups[group]}>
              {EXAMPLES.filter((example) => example.group === group).map(({ name }) => (
                <option key={name} value={`${group}/${name}`}>
                  {name.replaceAll('_', ' ')}
                </option>
              ))}
            </optgroup>
          ))}
        </select>
      </span>
      <span class="labelled">
        <label for="backend">{texts.header.backend}</label>
        <select id="backend" value={shown?.backend?.kind ?? 'cubic'} onChange={(event) => useBackend(event.currentTarget.value)}>
          {backends.value.map(({ kind, summary }) => (
            <option key={kind} value={kind} title={summary}>
              {kind}
            </option>
          ))}
        </select>
      </span>
      <button type="button" class="primary" onClick={() => void planNow()}>
        {planning.value ? texts.header.planning : texts.header.plan}
      </button>
      <div class="buttons" role="group">
        <button type="button" disabled={history.value.past.length === 0} onClick={undo}>
          {texts.header.undo}
        </button>
        <button type="button" disabled={history.value.future.length === 0} onClick={redo}>
          {texts.header.redo}
        </button>
      </div>
      <span class="spacer" />
      <button type="button" onClick={() => void copyLink()}>
        {texts.header.copyLink}
      </button>
      <button type="button" aria-label={texts.header.theme} title={texts.header.theme} onClick={switchTheme}>
        ◐
      </button>
      <a href="docs">{texts.header.docs}</a>
      {(problem.value?.code === 'unauthorized' || apiKey.value !== '') && <Key />}
      <p class="visually-hidden" role="status">
        {notice}
      </p>
    </header>
  );
}

// By itself the link would take the place of the request in the address.
function skip(event: Event): void {
  event.preventDefault();
  document.querySelector<HTMLElement>('#waypoints')?.focus();
}

function robotIds(shown: string | undefined): string[] {
  const ids = robots.value.map(({ id }) => id);
  return shown === undefined || ids.includes(shown) ? ids : [shown, ...ids];
}

function openExample(select: HTMLSelectElement): void {
  const example = EXAMPLES.find(({ group, name }) => `${group}/${name}` === select.value);
  select.value = '';
  if (example) void chooseExample(example);
}

function useBackend(kind: string): void {
  if (request.value) show({ ...request.value, backend: { kind } as Backend });
}

async function copyLink(): Promise<void> {
  await navigator.clipboard.writeText(location.href);
  notice.value = texts.said.linkCopied;
}

function Key() {
  return (
    <form
      class="key"
      onSubmit={(event) => {
        event.preventDefault();
        useKey(new FormData(event.currentTarget).get('key') as string);
        void settle(); // nothing has been answered without it, not even the robot
      }}
    >
      <label>
        {texts.header.key} <input name="key" type="password" autocomplete="off" defaultValue={apiKey.value} />
      </label>
      <button type="submit">{texts.header.useKey}</button>
      <span class="hint">{texts.header.keyHint}</span>
    </form>
  );
}
