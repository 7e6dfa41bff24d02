// A histogram: its bars, and beside its ends what lies between them.
import { texts } from '../texts';

const [WIDTH, HEIGHT] = [360, 110];

export interface Bars {
  least: number;
  mean: number;
  most: number;
  edges: readonly number[]; // one more than bars
  counts: readonly number[];
}

interface HistogramProps extends Bars {
  title: string;
  label: string;
  written: (value: number) => string; // with its unit
}

export function Histogram({ title, label, written, mean, edges, counts }: HistogramProps) {
  const tallest = Math.max(1, ...counts);
  const width = WIDTH / counts.length;
  return (
    <figure class="histogram">
      <figcaption>{title}</figcaption>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={label}>
        {counts.map((count, bar) => {
          const height = (HEIGHT * count) / tallest;
          return (
            <rect key={bar} x={bar * width + 1} y={HEIGHT - height} width={width - 2} height={height}>
              <title>{texts.batch.part(count, written(edges[bar]!))}</title>
            </rect>
          );
        })}
      </svg>
      <p class="ends">
        <span>{written(edges[0]!)}</span>
        <span>{texts.batch.mean(written(mean))}</span>
        <span>{written(edges.at(-1)!)}</span>
      </p>
    </figure>
  );
}

// The ends of so many equal parts.
export function equalParts(from: number, to: number, parts: number): number[] {
  return Array.from({ length: parts + 1 }, (_, part) => from + (part * (to - from)) / parts);
}
