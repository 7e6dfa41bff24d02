// The plots on the page, and what is shown in them.
import { useLayoutEffect, useRef } from 'preact/hooks';
import { effect, signal } from '@preact/signals';
import 'uplot/dist/uPlot.min.css';
import { playing, time } from '../state/playback';
import type { Planned } from '../state/store';
import { robot, shownPlan } from '../state/store';
import { theme } from '../state/theme';
import { toggleWhole, whole } from '../state/whole';
import type { Robot } from '../service/types';
import { texts } from '../texts';
import { curvesOf } from './curves';
import type { Curves, Plotted } from './curves';
import { Plot, PLOT_HEIGHT } from './plot';

const ALL: readonly Plotted[] = ['position', 'velocity', 'acceleration', 'jerk', 'torque', 'tool_speed'];

const chosen = signal<readonly Plotted[]>(['position', 'velocity']);
const focus = signal<number | null>(null);
const relative = signal(false);

export function PlotsView() {
  const [planned, arm] = [shownPlan.value, robot.value];
  if (!planned || !arm) return null;
  const joint = focus.value !== null && focus.value < arm.joints.length ? focus.value : null;
  return (
    <section class="plots" aria-label={texts.plots.label}>
      <div class="toolbar">
        <div role="group" aria-label={texts.plots.quantities} class="buttons">
          {ALL.map((quantity) => (
            <button key={quantity} type="button" aria-pressed={chosen.value.includes(quantity)} onClick={() => toggle(quantity)}>
              {texts.quantities[quantity]}
            </button>
          ))}
        </div>
        <label>
          {texts.plots.joint}{' '}
          <select value={joint ?? ''} onChange={(event) => (focus.value = indexOf(event.currentTarget.value))}>
            <option value="">{texts.plots.allJoints}</option>
            {arm.joint_names.map((name, index) => (
              <option key={name} value={index}>
                {name}
              </option>
            ))}
          </select>
        </label>
        <label>
          <input type="checkbox" checked={relative.value} onChange={(event) => (relative.value = event.currentTarget.checked)} />{' '}
          {texts.plots.relative}
        </label>
        <button type="button" aria-pressed={whole.value === 'plots'} onClick={() => toggleWhole('plots')}>
          {texts.plots.enlarge}
        </button>
        <span class="hint">
          {texts.plots.hint} {planned.answer.certificate.speed_zones && texts.zones.legend}
        </span>
      </div>
      {chosen.value.map((quantity) => (
        <PlotView key={quantity} quantity={quantity} planned={planned} arm={arm} joint={joint} share={relative.value} />
      ))}
    </section>
  );
}

function indexOf(value: string): number | null {
  return value === '' ? null : Number(value);
}

function toggle(quantity: Plotted): void {
  const shown = chosen.value;
  chosen.value = shown.includes(quantity)
    ? shown.filter((other) => other !== quantity)
    : ALL.filter((q) => q === quantity || shown.includes(q));
}

interface PlotProps {
  quantity: Plotted;
  planned: Planned;
  arm: Robot;
  joint: number | null;
  share: boolean;
}

function PlotView({ quantity, planned, arm, joint, share }: PlotProps) {
  const host = useRef<HTMLDivElement>(null);
  const curves = curvesOf(planned, arm, quantity, joint, share);
  const [shade, isWhole, count] = [theme.value, whole.value === 'plots', chosen.value.length];
  useLayoutEffect(
    () => (host.current && curves ? draw(host.current, curves, planned, isWhole ? heightOf(count) : PLOT_HEIGHT) : undefined),
    [planned, arm, joint, share, shade, curves?.unit, isWhole, isWhole && count],
  );
  const title = `${texts.quantities[quantity]}${curves ? ` (${curves.unit})` : ''}`;
  return (
    <figure class="plot">
      <figcaption>{title}</figcaption>
      {curves ? <div ref={host} role="img" aria-label={texts.plots.image(title)} /> : <p class="hint">{texts.plots.none[quantity]}</p>}
    </figure>
  );
}

const AROUND = 130; // px of the window: the time line and the buttons above the plots
const BESIDE = 75; // px of each plot: its title and legend

// So high that as many plots fill the window.
function heightOf(count: number): number {
  return Math.max(PLOT_HEIGHT, (innerHeight - AROUND) / count - BESIDE);
}

function draw(host: HTMLElement, curves: Curves, planned: Planned, height: number): () => void {
  const plot = new Plot(host, curves, planned.answer, height);
  const stop = effect(() => plot.setTime(time.value, !playing.value));
  const observer = new ResizeObserver(() => {
    plot.resize(host.clientWidth);
    plot.setTime(time.peek(), true);
  });
  observer.observe(host);
  return () => {
    stop();
    observer.disconnect();
    plot.destroy();
  };
}
