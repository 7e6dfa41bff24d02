// What the planning came to: refusal or certificate, comparison, the request itself, exports.
import { signal } from '@preact/signals';
import { estimateOfPlan } from '../plan/estimates';
import { seconds } from '../plan/units';
import type { PlanAnswer } from '../service/types';
import { durationOf } from '../state/playback';
import { isStale, planning, problem, robot, shownPlan } from '../state/store';
import { texts } from '../texts';
import { BatchPanel } from './BatchPanel';
import { Certificate } from './Certificate';
import { Compare } from './Compare';
import { Exports } from './Exports';
import { Refusal } from './Refusal';
import { RequestJson } from './RequestJson';
import { RobotHint } from './RobotNotes';
import { RobotPanel } from './RobotPanel';

type Tab = 'certificate' | 'compare' | 'request' | 'exports' | 'robot' | 'batch';

const TABS: readonly Tab[] = ['certificate', 'compare', 'request', 'exports', 'robot', 'batch'];
const tab = signal<Tab>('certificate');

export function Result() {
  const [planned, arm] = [shownPlan.value, robot.value];
  const estimate = planned && estimateOfPlan(planned.answer);
  return (
    <section class="panel result" aria-label={texts.result.label}>
      {problem.value && <Refusal problem={problem.value} />}
      {planned && !problem.value && (
        <p class={`verdict ${isStale.value || planning.value ? 'stale' : ''}`}>
          <strong>✓ {texts.result.certified(seconds(durationOf(planned)))}</strong>
          <span>{texts.result.certifiedBy(planned.answer.backend, planned.answer.solver, planned.took)}</span>
          {planned.answer.rides?.map((ride) => (
            <span key={ride.waypoint}>{meeting(ride)}</span>
          ))}
          {planned.answer.optimisation && <span>{shortened(planned.answer.optimisation)}</span>}
          {estimate && <span class="estimate">{estimate}</span>}
        </p>
      )}
      {arm && <RobotHint arm={arm} onNotes={() => (tab.value = 'robot')} />}
      {!planned && !problem.value && <p class="hint">{planning.value ? texts.header.planning : texts.result.none}</p>}
      <div class="tabs" role="tablist" onKeyDown={turn}>
        {TABS.map((name) => (
          <button
            key={name}
            type="button"
            role="tab"
            id={`tab-${name}`}
            aria-selected={tab.value === name}
            aria-controls="tab-panel"
            tabIndex={tab.value === name ? 0 : -1}
            onClick={() => (tab.value = name)}
          >
            {texts.result.tabs[name]}
          </button>
        ))}
      </div>
      <div role="tabpanel" id="tab-panel" class="tab-panel" aria-labelledby={`tab-${tab.value}`} tabIndex={0}>
        {tab.value === 'certificate' && <Certificate />}
        {tab.value === 'compare' && <Compare />}
        {tab.value === 'request' && <RequestJson />}
        {tab.value === 'exports' && <Exports />}
        {tab.value === 'robot' && <RobotPanel />}
        {tab.value === 'batch' && <BatchPanel />}
      </div>
    </section>
  );
}

function shortened({ first, last, iterates }: NonNullable<PlanAnswer['optimisation']>): string {
  return texts.result.shortened(seconds(first), seconds(last), iterates);
}

function meeting({ object, arrival, latest_start }: NonNullable<PlanAnswer['rides']>[number]): string {
  return texts.result.meets(object, seconds(arrival), latest_start > 0 ? seconds(latest_start) : null);
}

function turn(event: KeyboardEvent): void {
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (step === undefined) return;
  tab.value = TABS[(TABS.indexOf(tab.value) + step + TABS.length) % TABS.length]!;
  requestAnimationFrame(() => document.getElementById(`tab-${tab.value}`)?.focus());
}
