// Named projects of this browser: the shown request is saved, an earlier one is opened or deleted.
import { useState } from 'preact/hooks';
import { deleteProject, openProject, projects, saveProject } from '../state/projects';
import { texts } from '../texts';

export function Projects() {
  const [isFull, setFull] = useState(false);
  return (
    <section class="projects" aria-label={texts.projects.label}>
      <h3>{texts.projects.label}</h3>
      <ul>
        {Object.keys(projects.value).map((one) => (
          <li key={one} class="buttons">
            <button type="button" onClick={() => openProject(one)}>
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
          setFull(!saveProject(new FormData(event.currentTarget).get('name') as string));
        }}
      >
        <label>
          {texts.projects.name} <input name="name" autocomplete="off" required />
        </label>
        <button type="submit">{texts.projects.save}</button>
      </form>
      {isFull && (
        <p class="wrong-text" role="alert">
          {texts.projects.full}
        </p>
      )}
      <p class="hint">{texts.projects.hint}</p>
    </section>
  );
}
