// A plot by uPlot: curves, limit bands, waypoints, and the line of the time that is shown.
import uPlot from 'uplot';
import type { PlanAnswer } from '../service/types';
import { locate } from '../plan/samples';
import { short } from '../plan/units';
import { slowTimes } from '../plan/zones';
import type { Slow } from '../plan/zones';
import { seek } from '../state/playback';
import { styleColour } from '../state/theme';
import type { Curve, Curves } from './curves';
import { axisRange, shareLimits } from './curves';

export const PLOT_HEIGHT = 190;
const SYNC = 'time';

export class Plot {
  private readonly chart: uPlot;
  private readonly line = document.createElement('div');

  constructor(
    host: HTMLElement,
    shown: Curves,
    answer: PlanAnswer,
    private readonly height: number,
  ) {
    const [text, grid] = [styleColour('--text-soft'), styleColour('--grid')];
    const axis: uPlot.Axis = { stroke: text, grid: { stroke: grid, width: 1 }, ticks: { show: false }, font: '12px system-ui' };
    const range = axisRange(shown.curves, shown.slow);
    const slow = slowTimes(answer);
    const shared = shareLimits(shown.curves);
    this.chart = new uPlot(
      {
        width: Math.max(host.clientWidth, 200),
        height,
        cursor: { sync: { key: SYNC }, drag: { x: true, y: false }, points: { size: 6 } },
        scales: { x: { time: false }, y: { range: () => range } },
        axes: [
          { ...axis, size: 28, values: (_, ticks) => ticks.map((tick) => `${tick} s`) },
          { ...axis, size: 56 },
        ],
        legend: { markers: { width: 3 } },
        series: [
          { label: 't', value: (_, value: number | null) => (value === null ? '' : `${value.toFixed(3)} s`) },
          ...shown.curves.map(({ label, colour }): uPlot.Series => {
            return {
              label,
              stroke: colour,
              width: 1.6,
              pxAlign: 0,
              points: { show: false },
              value: (_, value: number | null) => numeral(value, shown.unit),
            };
          }),
        ],
        hooks: { drawClear: [(chart) => drawBackground(chart, shown, answer, slow, shared)] },
      },
      [shown.time, ...shown.curves.map(({ values }) => values)],
      host,
    );
    this.line.className = 'plot-time';
    this.chart.over.append(this.line);
    this.chart.over.addEventListener('click', () => this.seek());
  }

  private seek(): void {
    const { left } = this.chart.cursor;
    if (left !== undefined && left >= 0 && this.chart.select.width === 0) seek(this.chart.posToVal(left, 'x'));
  }

  // Moves the line; the values there are written while nothing is played, since nobody reads them on the way.
  setTime(time: number, withValues: boolean): void {
    const at = this.chart.valToPos(time, 'x');
    this.line.hidden = at < 0 || at > this.chart.bbox.width / devicePixelRatio; // its element would be laid out to be asked
    this.line.style.transform = `translateX(${at}px)`;
    if (!withValues || (this.chart.cursor.left ?? -1) >= 0) return;
    const [index, share] = locate(this.chart.data[0] as number[], time);
    this.chart.setLegend({ idx: index + Math.round(share) });
  }

  resize(width: number): void {
    if (width > 0 && width !== this.chart.width) this.chart.setSize({ width, height: this.height });
  }

  destroy(): void {
    this.chart.destroy();
  }
}

function numeral(value: number | null, unit: string): string {
  if (value === null) return '';
  return `${Math.abs(value) < 1 ? Number(value.toFixed(3)) : short(value)}${unit === '%' ? ' %' : ''}`;
}

function drawBackground(chart: uPlot, shown: Curves, answer: PlanAnswer, slow: readonly Slow[], shared: boolean): void {
  const { ctx, bbox } = chart;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.lineWidth = devicePixelRatio;
  ctx.fillStyle = styleColour('--slow');
  for (const { from, to } of slow) fillTimes(chart, from, to);
  for (const { arrival_time, departure_time } of answer.waypoints) {
    ctx.fillStyle = styleColour('--rest');
    fillTimes(chart, arrival_time, departure_time);
    ctx.fillStyle = styleColour('--grid-strong');
    ctx.fillRect(chart.valToPos(arrival_time, 'x', true), bbox.top, devicePixelRatio, bbox.height);
  }
  for (const curve of shared ? shown.curves.slice(0, 1) : shown.curves) drawLimits(chart, curve, shown, shared);
  drawSlow(chart, shown.slow);
  ctx.restore();
}

function fillTimes(chart: uPlot, since: number, until: number): void {
  const [from, to] = [chart.valToPos(since, 'x', true), chart.valToPos(until, 'x', true)];
  if (to > from) chart.ctx.fillRect(from, chart.bbox.top, to - from, chart.bbox.height);
}

// What is allowed near objects, as dashed steps.
function drawSlow(chart: uPlot, slow: readonly Slow[]): void {
  const { ctx } = chart;
  ctx.strokeStyle = styleColour('--bad');
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  for (const { from, to, limit } of slow) {
    const at = chart.valToPos(limit, 'y', true);
    ctx.beginPath();
    ctx.moveTo(chart.valToPos(from, 'x', true), at);
    ctx.lineTo(chart.valToPos(to, 'x', true), at);
    ctx.stroke();
  }
  ctx.setLineDash([]);
}

// The limits as dashed lines with a step where a segment ends; where all curves share them, what lies beyond is shaded.
function drawLimits(chart: uPlot, { bands, colour }: Curve, { time, segment }: Curves, shared: boolean): void {
  const { ctx, bbox } = chart;
  ctx.strokeStyle = shared ? styleColour('--bad') : colour;
  ctx.fillStyle = styleColour('--beyond');
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  const x = time.map((at) => chart.valToPos(at, 'x', true));
  for (let first = 0, end; first < x.length; first = end) {
    for (end = first + 1; end < x.length && segment[end] === segment[first];) end++;
    for (const [side, beyond] of [
      ['lower', bbox.top + bbox.height],
      ['upper', bbox.top],
    ] as const) {
      if (bands[first]![side] === null) continue;
      const points = bands.slice(first, end).map((band, i): [number, number] => [x[first + i]!, chart.valToPos(band[side]!, 'y', true)]);
      const last: [number, number] = [x[Math.min(end, x.length - 1)]!, points.at(-1)![1]];
      const line = new Path2D();
      for (const [at, y] of [...points, last]) line.lineTo(at, y);
      ctx.stroke(line);
      if (!shared) continue;
      line.lineTo(last[0], beyond);
      line.lineTo(points[0]![0], beyond);
      ctx.fill(line);
    }
  }
  ctx.setLineDash([]);
}
