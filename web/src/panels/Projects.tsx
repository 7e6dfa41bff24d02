// Named projects of this browser: the shown request is saved, an earlier one is opened or deleted.
import { useState } from 'preact/hooks';
import { deleteProject, openProject, projects, saveProject } from '../state/projects';
import { texts } from '../texts';

export function Projects() {
  const [failed, setFailed] = useState<{ name: string; why: 'full' | 'changed' } | null>(null);
  const save = (name: string, overwrites = false): void => {
    const why = saveProject(name, overwrites);
    setFailed(why === 'saved' ? null : { name, why });
  };
  const open = (name: string): void => {
    setFailed(null);
    openProject(name);
  };
  return (
    <section class="projects" aria-label={texts.projects.label}>
      <h3>{texts.projects.label}</h3>
      <ul>
        {Object.keys(projects.value).map((one) => (
          <li key={one} class="buttons">
            <button type="button" onClick={() => open(one)}>
              {one}
            </button>
            <button
              type="button"
              aria-label={texts.projects.remove(one)}
              title={texts.projects.remove(one)}
              onClick={() => deleteProject(one)}
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
          save(new FormData(event.currentTarget).get('name') as string);
        }}
      >
        <label>
          {texts.projects.name} <input name="name" autocomplete="off" required />
        </label>
        <button type="submit">{texts.projects.save}</button>
      </form>
      {failed?.why === 'full' && (
        <p class="wrong-text" role="alert">
          {texts.projects.full}
        </p>
      )}
      {failed?.why === 'changed' && (
        <div role="alert">
          <p class="wrong-text">{texts.projects.changed(failed.name)}</p>
          <div class="buttons wrap">
            <button type="button" onClick={() => save(failed.name, true)}>
              {texts.projects.overwrite}
            </button>
            <button type="button" onClick={() => open(failed.name)}>
              {texts.projects.openOther}
            </button>
          </div>
        </div>
      )}
      <p class="hint">{texts.projects.hint}</p>
    </section>
  );
}
