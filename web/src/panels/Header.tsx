// The top of the page: robot, example, back end, plan, undo and redo.
import { useState } from 'preact/hooks';
import { EXAMPLES, TASK_EXAMPLES } from '../request/examples';
import type { Example } from '../request/examples';
import { apiKey, useKey } from '../service/client';
import { chooseBackend, chooseExample, chooseRobot, redo, settle, undo } from '../state/actions';
import { openTaskExample } from '../state/ordering';
import { planNow } from '../state/planning';
import { linkToShown, writeAddress } from '../state/start';
import { say, showBanner } from '../state/messages';
import { backends, history, notice, planning, problem, request, robot, robots } from '../state/store';
import { switchTheme } from '../state/theme';
import { language, switchLanguage, texts } from '../texts';
import { Banner } from './Banner';
import { Menu } from './Menu';
import { RobotNotes } from './RobotNotes';
import { copy } from './save';

const KINDS: readonly Example['group'][] = ['documents', 'jobs', 'features', 'cells'];

const OF_REQUESTS = KINDS.map((kind) => ({
  label: texts.header.groups[kind],
  items: EXAMPLES.filter(({ group }) => group === kind).map((example) => ({
    text: example.name.replaceAll('_', ' '),
    onChoose: () => void chooseExample(example),
  })),
}));

const OF_TASKS = {
  label: texts.header.groups.tasks,
  items: TASK_EXAMPLES.map(({ name, load }) => ({
    text: name.replaceAll('_', ' '),
    onChoose: () => void openTaskExample(load),
  })),
};

const GROUPS = [...OF_REQUESTS, OF_TASKS];

export function Header() {
  const [shown, arm] = [request.value, robot.value];
  return (
    <header class="header">
      <a class="skip" href="#waypoints" onClick={skip}>
        {texts.skip}
      </a>
      <h1>{texts.title}</h1>
      <span class="labelled">
        <label for="robot">{texts.header.robot}</label>
        <select id="robot" value={shown?.robot ?? ''} onChange={(event) => void chooseRobot(event.currentTarget.value)}>
          {robotIds(shown?.robot).map(([id, text]) => (
            <option key={id} value={id}>
              {text}
            </option>
          ))}
        </select>
      </span>
      {arm && <RobotNotes key={arm.id} arm={arm} />}
      <Menu label={texts.header.chooseExample} groups={GROUPS} />
      <span class="labelled">
        <label for="backend">{texts.header.backend}</label>
        <select id="backend" value={shown?.backend?.kind ?? 'cubic'} onChange={(event) => chooseBackend(event.currentTarget.value)}>
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
      <CopyLink />
      <button type="button" aria-label={texts.header.theme} title={texts.header.theme} onClick={switchTheme}>
        ◐
      </button>
      <button type="button" lang={language === 'de' ? 'en' : 'de'} onClick={() => void writeAddress().then(switchLanguage)}>
        {texts.header.language}
      </button>
      <a href="docs">{texts.header.docs}</a>
      {(problem.value?.code === 'unauthorized' || apiKey.value !== '') && <Key />}
      <p class="visually-hidden" role="status">
        {notice}
      </p>
      <Banner />
    </header>
  );
}

// By itself the link would take the place of the request in the address.
function skip(event: Event): void {
  event.preventDefault();
  document.querySelector<HTMLElement>('#waypoints')?.focus();
}

// The robots that can be chosen, and the one that the request names.
function robotIds(shown: string | undefined): [string, string][] {
  const known = robots.value.map(({ id }): [string, string] => [id, id]);
  if (shown === undefined || known.some(([id]) => id === shown)) return known;
  return [[shown, known.length > 0 ? texts.header.unknownRobot(shown) : shown], ...known];
}

function CopyLink() {
  const [isCopied, setCopied] = useState(false);
  const copyLink = async (): Promise<void> => {
    const link = await linkToShown();
    if (await copy(link)) {
      setCopied(true);
      setTimeout(() => setCopied(false), 1500);
      say(texts.said.linkCopied);
    } else showBanner({ text: texts.said.copyByHand, link });
  };
  return (
    <button type="button" onClick={() => void copyLink()}>
      {isCopied ? texts.header.linkCopied : texts.header.copyLink}
    </button>
  );
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
