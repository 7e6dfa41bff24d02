// Where the tool can be: a cloud on the stage, and how far it goes; the robot is shown at each of these figures.
import { decimal, shownIn } from '../plan/units';
import type { WorkspaceAnswer } from '../service/types';
import { pose } from '../state/jointPosition';
import { cutWorkspace, isCut, isShown, showWorkspace, workspace } from '../state/workspace';
import { texts } from '../texts';
import { ProblemText } from './Message';

const FIGURES = ['minimum_reach', 'maximum_reach', 'minimum_height', 'maximum_height', 'minimum_radius', 'maximum_radius'] as const;

export function Workspace() {
  const found = workspace.value;
  return (
    <section class="workspace" aria-label={texts.workspace.label}>
      <h3>{texts.workspace.label}</h3>
      <label>
        <input type="checkbox" checked={isShown.value} onChange={(event) => showWorkspace(event.currentTarget.checked)} />{' '}
        {texts.workspace.show}
      </label>
      <label>
        <input
          type="checkbox"
          disabled={!isShown.value}
          checked={isCut.value}
          onChange={(event) => cutWorkspace(event.currentTarget.checked)}
        />{' '}
        {texts.workspace.cut}
      </label>
      {isShown.value && !found && <p class="hint">{texts.workspace.asking}</p>}
      {found?.problem && (
        <div class="wrong-text" role="alert">
          <ProblemText problem={found.problem} />
        </div>
      )}
      {found?.answer && <Figures answer={found.answer} />}
    </section>
  );
}

function Figures({ answer }: { answer: WorkspaceAnswer }) {
  return (
    <>
      <p class="hint reach-key">
        {texts.workspace.colours} {lengthOf(answer.minimum_reach.value)} <span class="speed-scale" /> {lengthOf(answer.maximum_reach.value)}
      </p>
      <table>
        <tbody>
          {FIGURES.map((figure) => (
            <tr key={figure}>
              <th scope="row">{texts.workspace.figures[figure]}</th>
              <td>{lengthOf(answer[figure].value)}</td>
              <td>
                <button
                  type="button"
                  class="link"
                  aria-label={texts.workspace.goTo(texts.workspace.figures[figure])}
                  onClick={() => pose(answer[figure].position)}
                >
                  {texts.workspace.go}
                </button>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="hint">{texts.workspace.hint(answer.points.length)}</p>
    </>
  );
}

// Figures are within rounding error of what they are.
function lengthOf(metres: number): string {
  return `${Number(decimal(metres, 'm'))} ${shownIn('m').name}`;
}
