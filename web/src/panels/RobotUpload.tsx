// A form for a robot of the user's own: URDF, SRDF and the files of its meshes; and what the service says of it.
import { findingsOf, messageOf } from '../request/messages';
import type { Finding } from '../service/types';
import { idOf, upload, uploadRobot } from '../state/uploading';
import { texts } from '../texts';
import { Original, ProblemText } from './Message';

export function RobotUpload() {
  const state = upload.value;
  return (
    <section aria-label={texts.robot.upload}>
      <h3>{texts.robot.upload}</h3>
      <form
        class="upload"
        onSubmit={(event) => {
          event.preventDefault();
          send(event.currentTarget);
        }}
      >
        <FileField name="urdf" label={texts.robot.urdf} accept=".urdf,.xml" required />
        <FileField name="srdf" label={texts.robot.srdf} accept=".srdf,.xml" />
        <FileField name="meshes" label={texts.robot.meshes} accept=".zip" />
        <label>
          {texts.robot.id} <input name="id" autocomplete="off" placeholder={texts.robot.idHint} pattern="[A-Za-z0-9][A-Za-z0-9_\-]*" />
        </label>
        <button type="submit" class="primary" disabled={state?.kind === 'running'}>
          {state?.kind === 'running' ? texts.robot.uploading : texts.robot.add_robot}
        </button>
      </form>
      {state?.kind === 'added' && <p role="status">{texts.robot.added(state.id)}</p>}
      {state?.kind === 'added' && <Findings findings={state.findings} />}
      {state?.kind === 'refused' && (
        <div class="refusal" role="alert" aria-label={texts.robot.refused}>
          <strong>{messageOf(state.problem).title}</strong>
          <ProblemText problem={state.problem} />
          <Findings findings={state.problem.findings ?? []} />
        </div>
      )}
    </section>
  );
}

interface FileProps {
  name: string;
  label: string;
  accept: string;
  required?: boolean;
}

function FileField({ name, label, accept, required }: FileProps) {
  return (
    <label>
      {label} <input type="file" name={name} accept={accept} required={required} />
    </label>
  );
}

function Findings({ findings }: { findings: readonly Finding[] }) {
  if (findings.length === 0) return null;
  const said = findingsOf(findings);
  return (
    <>
      <ul class="findings">
        {said.map(({ severity, text }) => (
          <li key={severity + text} class={severity}>
            <strong>{texts.robot.severities[severity] ?? severity}</strong> {text}
          </li>
        ))}
      </ul>
      <Original texts={said.flatMap(({ original }) => original)} />
    </>
  );
}

function send(form: HTMLFormElement): void {
  const data = new FormData(form);
  const file = (name: string): File | undefined => {
    const found = data.get(name);
    return found instanceof File && found.size > 0 ? found : undefined;
  };
  const urdf = file('urdf');
  if (!urdf) return;
  const id = (data.get('id') as string) || idOf(urdf.name);
  void uploadRobot({ id, urdf, srdf: file('srdf'), meshes: file('meshes') });
}
