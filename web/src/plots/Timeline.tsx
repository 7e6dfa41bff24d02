// The time line: play, scrub, speed, and where the waypoints are.
import { useComputed } from '@preact/signals';
import { plannedWaypoint } from '../plan/samples';
import { seconds } from '../plan/units';
import { slowTimes } from '../plan/zones';
import { durationOf, playAt, playing, seek, speed, SPEEDS, time, togglePlaying } from '../state/playback';
import { select } from '../state/selection';
import { shownPlan } from '../state/store';
import type { Planned } from '../state/store';
import { texts } from '../texts';

export function Timeline() {
  const planned = shownPlan.value;
  const marked = planned?.answer.waypoints.filter((waypoint) => plannedWaypoint(planned.answer, waypoint.index) === waypoint) ?? [];
  const duration = durationOf(planned);
  const slow = planned ? slowTimes(planned.answer) : [];
  const shown = useComputed(() => seconds(Math.min(time.value, durationOf(shownPlan.value))));
  return (
    <section class="timeline" aria-label={texts.timeline.label}>
      <button type="button" class="play" disabled={!planned} onClick={togglePlaying}>
        {playing.value ? texts.timeline.pause : texts.timeline.play}
      </button>
      <div class="track">
        <input
          type="range"
          min="0"
          max={duration || 1}
          step="any"
          value={time}
          disabled={!planned}
          aria-label={texts.timeline.time}
          onInput={(event) => seek(event.currentTarget.valueAsNumber)}
          onKeyDown={(event) => stepBy(event, duration)}
        />
        <div class="marks">
          {slow.map(({ from, to }) => (
            <span
              key={from}
              class="slow"
              title={texts.zones.legend}
              style={{ left: `${(100 * from) / duration}%`, width: `${(100 * (to - from)) / duration}%` }}
            />
          ))}
          {waitsOf(planned).map(({ from, to }) => (
            <span
              key={from}
              class="wait"
              title={texts.cells.waiting(seconds(to - from))}
              style={{ left: `${(100 * from) / duration}%`, width: `${(100 * (to - from)) / duration}%` }}
            />
          ))}
          {marked.length <= 40 &&
            marked.map(({ index, name, arrival_time }) => (
              <button
                key={index}
                type="button"
                class="mark"
                tabIndex={-1}
                style={{ left: `${(100 * arrival_time) / duration}%` }}
                title={texts.timeline.mark(index, name ?? null, seconds(arrival_time))}
                aria-label={texts.timeline.mark(index, name ?? null, seconds(arrival_time))}
                onClick={() => select(index)}
              >
                {index}
              </button>
            ))}
        </div>
      </div>
      <output class="time">{planned ? [shown, ' / ', seconds(duration)] : texts.timeline.nothing}</output>
      <label>
        <span class="visually-hidden">{texts.timeline.speed}</span>
        <select value={speed.value} onChange={(event) => playAt(Number(event.currentTarget.value))}>
          {SPEEDS.map((factor) => (
            <option key={factor} value={factor}>
              {factor}×
            </option>
          ))}
        </select>
      </label>
    </section>
  );
}

// When the robot that is shown waits for others of its cell: the last part of its rests.
function waitsOf(planned: Planned | null): { from: number; to: number }[] {
  const own = planned?.cell?.robots[planned.request.cell?.index ?? 0];
  return (own?.waits ?? []).flatMap((wait, index) => {
    const to = plannedWaypoint(own!.plan, index)?.departure_time ?? 0;
    return wait > 0 ? [{ from: to - wait, to }] : [];
  });
}

// With step "any" a browser leaves the steps of keys to us: a hundredth, a tenth with page up and down.
function stepBy(event: KeyboardEvent, duration: number): void {
  const steps: Record<string, number> = {
    ArrowLeft: -0.01,
    ArrowRight: 0.01,
    ArrowDown: -0.01,
    ArrowUp: 0.01,
    PageDown: -0.1,
    PageUp: 0.1,
  };
  const step = steps[event.key];
  if (step === undefined) return;
  event.preventDefault();
  seek(time.value + step * duration);
}
