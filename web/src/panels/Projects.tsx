// Named projects of this browser and of the service: the shown request is saved, an earlier one is opened or deleted.
import { useEffect, useState } from 'preact/hooks';
import { apiKey } from '../service/client';
import { deleteProject, openProject, projects, saveProject } from '../state/projects';
import type { Failure } from '../state/projects';
import { deleteOnService, listProjects, openFromService, saveOnService, serviceProjects } from '../state/service_projects';
import { texts } from '../texts';
import { ProblemText } from './Message';

const BROWSER: Keeper = { label: 'browser', save: saveProject, open: openProject, remove: deleteProject };
const SERVICE: Keeper = {
  label: 'service',
  save: saveOnService,
  open: openFromService,
  remove: deleteOnService,
  pattern: '[^.\\/\\s][^\\/]*', // of the service
  longest: 100,
};

export function Projects() {
  useEffect(() => void listProjects(), [apiKey.value]);
  return (
    <>
      <Kept keeper={BROWSER} names={Object.keys(projects.value)} />
      <Kept keeper={SERVICE} names={serviceProjects.value.map(({ name }) => name)} />
    </>
  );
}

type Result = Promise<Failure | null> | Failure | null;

// Who keeps projects by name.
interface Keeper {
  label: 'browser' | 'service';
  save: (name: string, overwrites?: boolean) => Result;
  open: (name: string) => Result;
  remove: (name: string) => Result;
  pattern?: string;
  longest?: number;
}

function Kept({ keeper, names }: { keeper: Keeper; names: readonly string[] }) {
  const [failed, setFailed] = useState<{ name: string; failure: Failure } | null>(null);
  const own = texts.projects[keeper.label];
  const act = async (name: string, result: Result): Promise<void> => {
    const failure = await result;
    setFailed(failure && { name, failure });
  };
  return (
    <section class="projects" aria-label={own.label}>
      <h3>{own.label}</h3>
      <ul>
        {names.map((one) => (
          <li key={one} class="buttons">
            <button type="button" onClick={() => void act(one, keeper.open(one))}>
              {one}
            </button>
            <button
              type="button"
              aria-label={texts.projects.remove(one)}
              title={texts.projects.remove(one)}
              onClick={() => void act(one, keeper.remove(one))}
            >
              ✕
            </button>
          </li>
        ))}
      </ul>
      <form
        class="open-batch"
        onSubmit={(event) => {
          event.preventDefault();
          const name = new FormData(event.currentTarget).get('name') as string;
          void act(name, keeper.save(name));
        }}
      >
        <label>
          {texts.projects.name}{' '}
          <input
            name="name"
            autocomplete="off"
            required
            pattern={keeper.pattern}
            maxLength={keeper.longest}
            title={keeper.pattern && texts.projects.form}
          />
        </label>
        <button type="submit">{texts.projects.save}</button>
      </form>
      {failed && (
        <Failed
          {...failed}
          onOverwrite={() => void act(failed.name, keeper.save(failed.name, true))}
          onOpen={() => void act(failed.name, keeper.open(failed.name))}
        />
      )}
      <p class="hint">{own.hint}</p>
    </section>
  );
}

function Failed({ name, failure, onOverwrite, onOpen }: { name: string; failure: Failure; onOverwrite: () => void; onOpen: () => void }) {
  if (!('why' in failure) || failure.why === 'full')
    return (
      <div class="wrong-text" role="alert">
        {'problem' in failure ? (
          <ProblemText problem={failure.problem} />
        ) : (
          <p>{'fault' in failure ? `${texts.json.wrong} ${failure.fault}` : texts.projects.full}</p>
        )}
      </div>
    );
  return (
    <div role="alert">
      <p class="wrong-text">{texts.projects.changed(name)}</p>
      <div class="buttons wrap">
        <button type="button" onClick={onOverwrite}>
          {texts.projects.overwrite}
        </button>
        <button type="button" onClick={onOpen}>
          {texts.projects.openOther}
        </button>
      </div>
    </div>
  );
}
