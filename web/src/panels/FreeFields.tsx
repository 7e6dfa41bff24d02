// What a way around is made better by, for how long, and what that has gained.
import { plannedWaypoint } from '../plan/samples';
import { written } from '../plan/units';
import { budgeted, optimised } from '../request/motions';
import type { FreeMotion } from '../service/types';
import { isStale, shownPlan } from '../state/store';
import { texts } from '../texts';
import { Choice, NumberField } from './fields';

const OBJECTIVES = ['', 'duration', 'effort', 'path_length'] as const;
const OPTIONS = OBJECTIVES.map((objective) => [objective, texts.editor.objectives[objective || 'none']] as const);
const UNITS = { duration: 's', effort: 's', path_length: 'rad' } as const; // of the service
const LONGEST = 600; // s

interface FreeProps {
  motion: FreeMotion;
  index: number;
  change: (motion: FreeMotion) => void;
}

export function FreeFields({ motion, index, change }: FreeProps) {
  const gain = isStale.value || !shownPlan.value ? null : plannedWaypoint(shownPlan.value.answer, index)?.gain;
  return (
    <>
      <Choice
        label={texts.editor.optimise}
        value={motion.optimise ?? ''}
        options={OPTIONS}
        onValue={(objective) => change(optimised(motion, objective || null))}
      />
      {motion.optimise && (
        <NumberField
          label={texts.editor.timeBudget}
          unit="s"
          value={motion.time_budget}
          placeholder={texts.editor.usual}
          min={0}
          max={LONGEST}
          onValue={(budget) => change(budgeted(motion, budget))}
        />
      )}
      {gain && (
        <p class="hint gain">
          {texts.editor.gain(
            texts.editor.objectives[gain.objective],
            written(gain.first, UNITS[gain.objective]),
            written(gain.last, UNITS[gain.objective]),
            gain.candidates,
          )}
        </p>
      )}
    </>
  );
}
