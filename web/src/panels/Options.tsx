// The options of a goal set: which of them the plan has, and the reasons against the others.
import { useId } from 'preact/hooks';
import { optionChosen, withoutOption } from '../request/options';
import { refusalOf } from '../request/messages';
import { seconds } from '../plan/units';
import type { GoalSet, OptionOutcome } from '../service/types';
import { edit } from '../state/draft';
import { isStale, problem, shownPlan } from '../state/store';
import { texts } from '../texts';
import { Original } from './Message';

export function Options({ goalSet, index }: { goalSet: GoalSet; index: number }) {
  const id = useId();
  const choices = problem.value ? problem.value.choices : isStale.value ? null : shownPlan.value?.answer.choices;
  const outcomes = choices?.find(({ waypoint }) => waypoint === index)?.options ?? [];
  return (
    <section aria-labelledby={id}>
      <h3 id={id}>{texts.options.label}</h3>
      <ol class="options" start={0}>
        {goalSet.options.slice(0, MOST_LISTED).map((option, number) => (
          <li key={number} class={outcomes[number]?.status === 'chosen' ? 'chosen' : ''}>
            <span>
              {number} <strong>{nameOf(option)}</strong> {outcomes[number] && <Outcome outcome={outcomes[number]} />}
            </span>
            {goalSet.options.length > 1 && (
              <span class="buttons">
                <button type="button" onClick={() => edit(optionChosen(goalSet, number))}>
                  {texts.options.only}
                </button>
                <button type="button" aria-label={texts.options.remove(number)} onClick={() => edit(withoutOption(goalSet, number))}>
                  ✕
                </button>
              </span>
            )}
          </li>
        ))}
      </ol>
      {goalSet.options.length > MOST_LISTED && <p class="hint">{texts.scene.more(goalSet.options.length - MOST_LISTED)}</p>}
    </section>
  );
}

const MOST_LISTED = 100;

function nameOf(option: GoalSet['options'][number]): string {
  const goal = option.kind === 'sequence' ? option.waypoints.at(-1)! : option;
  return goal.name ?? texts.waypoints.kinds[goal.kind];
}

function Outcome({ outcome }: { outcome: OptionOutcome }) {
  const { status, estimated_duration, code, message } = outcome;
  if (status !== 'refused')
    return <small>{texts.options.outcomes[status](estimated_duration === null ? '–' : seconds(estimated_duration))}</small>;
  const own = refusalOf(code ?? '');
  return (
    <>
      <small>{texts.options.refused(own ?? message ?? '')}</small>
      <Original texts={own && message ? [message] : []} />
    </>
  );
}
