// Why there is no plan: the place, the joint, the waypoint, and remedies that apply at a click.
import type { PlanRequest, Problem, Remedy } from '../service/types';
import { changeInWords } from '../request/changes';
import { messageOf } from '../request/messages';
import { nameOf, remediedCell, showing } from '../request/cells';
import { waysOf } from '../request/edits';
import { depthOf, seconds, written } from '../plan/units';
import { show } from '../state/actions';
import { chooseRobotOfCell } from '../state/cells';
import { select } from '../state/selection';
import { ownProblem, refusedRobot, request, robot, shownPlan } from '../state/store';
import { language, texts } from '../texts';
import { Original } from './Message';

export function Refusal({ problem }: { problem: Problem }) {
  const { waypoint, segment, joint, time, pair } = problem;
  const { title, sentences, original } = messageOf(problem, robot.value?.joints);
  const isOwn = original.length === 0;
  const faults = (problem.errors ?? []).map(({ pointer, message }) => `${pointer || '/'}: ${message}`);
  const where = [
    refusedRobot.value !== null && request.value?.cell ? texts.cells.ofRobot(nameOf(refusedRequest()!)) : null,
    typeof waypoint === 'number' && typeof segment !== 'number' ? place(waypoint) : null,
    typeof segment === 'number' ? texts.refusal.segment(segment, place(segment), place(segment + 1)) : null,
    joint,
    typeof time === 'number' && !pair ? texts.refusal.at(seconds(time)) : null,
  ].filter((part) => part !== null && part !== undefined);
  return (
    <section class="refusal" role="alert" aria-label={texts.refusal.label}>
      <h2>{title}</h2>
      <p>{sentences.join(' ')}</p>
      {where.length > 0 && (
        <p class="where">
          {where.join(', ')}{' '}
          {typeof waypoint === 'number' && (
            <button type="button" class="link" onClick={() => showWaypoint(waypoint)}>
              {texts.refusal.show}
            </button>
          )}
        </p>
      )}
      {problem.pair && typeof problem.depth === 'number' && (
        <p class="where">
          {texts.refusal.pair(
            problem.pair,
            depthOf({ depth: problem.depth }),
            typeof problem.time === 'number' ? seconds(problem.time) : null,
          )}
        </p>
      )}
      {(ownProblem.value?.place ?? ownProblem.value?.position) && <p class="hint">{texts.refusal.place}</p>}
      {problem.nearest && <p class="hint">{texts.refusal.nearest(written(problem.nearest.position_distance, 'm', 3))}</p>}
      {problem.errors && !isOwn && <p>{texts.messages.fields}</p>}
      {problem.errors && (
        <ul>
          {problem.errors.map(({ pointer, message }) => (
            <li key={pointer + message}>
              <code>{pointer || '/'}</code> {isOwn && message}
            </li>
          ))}
        </ul>
      )}
      <Original texts={isOwn ? [] : [...original, ...faults]} />
      <Remedies title={texts.refusal.remedies} remedies={problem.remedies ?? []} />
      <Remedies title={texts.refusal.hints} remedies={problem.hints ?? []} />
      {shownPlan.value && <p class="hint">{texts.refusal.last}</p>}
    </section>
  );
}

function Remedies({ title, remedies }: { title: string; remedies: readonly Remedy[] }) {
  if (remedies.length === 0) return null;
  return (
    <>
      <h3>{title}</h3>
      <ul class="remedies">
        {waysOf(remedies).map((way) => (
          <li key={way.remedies.map(({ change }) => change).join()}>
            <div>
              <strong>{texts.refusal.ways[way.kind]}</strong>
              {way.remedies.map(({ change, value, explanation }) => (
                <p key={change}>
                  {changeInWords(change, value, place)}
                  {language === 'en' && <small>{explanation}</small>}
                </p>
              ))}
              <details>
                <summary>{texts.refusal.json}</summary>
                {way.remedies.map(({ change, value }) => (
                  <code key={change}>
                    {change} → {JSON.stringify(value)}
                  </code>
                ))}
              </details>
              {language !== 'en' && <Original texts={way.remedies.map(({ explanation }) => explanation)} />}
            </div>
            <button type="button" class="primary" onClick={() => apply(way.remedies)}>
              {texts.refusal.apply}
            </button>
          </li>
        ))}
      </ul>
    </>
  );
}

// A waypoint as the page names it.
function place(index: number): string {
  return texts.waypoints.place(index, refusedRequest()?.waypoints[index]?.name ?? null);
}

// The request that the refusal is about: in a cell that of one of the robots.
function refusedRequest(): PlanRequest | null {
  const [shown, index] = [request.value, refusedRobot.value];
  return shown && index !== null ? showing(shown, index) : shown;
}

function showWaypoint(index: number): void {
  if (refusedRobot.value !== null) chooseRobotOfCell(refusedRobot.value);
  select(index);
}

function apply(remedies: readonly Remedy[]): void {
  if (request.value) show(remediedCell(request.value, remedies), texts.said.remedied);
}
