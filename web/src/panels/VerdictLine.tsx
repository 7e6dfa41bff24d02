// The verdict in one line above the stage, on screens on which the result stands below; it leads there.
import { seconds } from '../plan/units';
import { durationOf } from '../state/playback';
import { isStale, planning, problem, shownPlan } from '../state/store';
import { texts } from '../texts';

export function VerdictLine() {
  const [planned, refused] = [shownPlan.value, problem.value];
  if (!planned && !refused) return null;
  const isOld = isStale.value || planning.value;
  return (
    <button type="button" class={`verdict-line ${refused ? 'refused' : ''} ${isOld ? 'stale' : ''}`} onClick={goToResult}>
      {refused ? `✕ ${refused.title}` : `✓ ${texts.result.certified(seconds(durationOf(planned)))}`}
    </button>
  );
}

function goToResult(): void {
  document.querySelector('.result')?.scrollIntoView({ block: 'start' });
}
