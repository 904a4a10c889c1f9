/** One metric of one or several runs against cycles, drawn by uPlot. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { short } from "../format";
import { isConstant } from "../rounding";

export interface PlotColors {
  ink: string;
  faint: string;
  line: string;
  accent: string;
}

/** How the line of a run looks. */
export interface CurveStyle {
  color: string;
  /** Lengths of dashes and gaps in pixels; none for a whole line. */
  dash: readonly number[];
}

/** The values of a run, and the cycles that they belong to. */
export interface Curve {
  cycles: readonly number[];
  values: readonly (number | null)[];
}

export interface PlotHooks {
  /** Receives the cycle under the pointer; null once it has left. */
  onHover(cycle: number | null): void;
  /** Receives a clicked cycle. */
  onClick(cycle: number): void;
}

/** The range of an axis: round, with zero if it is near, and not empty for constant values. */
function rangeOf(low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null) return [0, 1];
  if (isConstant(low, high)) return low === 0 ? [0, 1] : [low - 0.5 * Math.abs(low), high + 0.5 * Math.abs(high)];
  return uPlot.rangeNum(low, high, 0.1, true);
}

/** A value holds until the next cycle of which one is known; no line leads through values that no cycle had. */
const steps = uPlot.paths.stepped!({ align: 1 });

/** The range of the cycles: up to the one on the canvas, also where the metrics of the last ones are not known yet. */
function cyclesUpTo(now: number, first: number | null, last: number | null): uPlot.Range.MinMax {
  const start = first ?? 0;
  return [start, Math.max(last ?? 0, now, start + 1)];
}

/**
 * Runs a function whose canvases are drawn by the processor. Where a browser has no graphics processor, a curve of some
 * hundred steps that is drawn by the program in its place takes longer than the view's picture of ten thousand robots.
 */
function withCanvasesOnProcessor<T>(create: () => T): T {
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string) {
    return getContext.call(this, kind, { willReadFrequently: true });
  } as typeof getContext;
  try {
    return create();
  } finally {
    HTMLCanvasElement.prototype.getContext = getContext;
  }
}

/**
 * Time between two drawings of a curve whose cycles grow: each costs a software renderer as much as the view's picture, and
 * the line of the present cycle, which is no part of the drawing, moves meanwhile.
 */
const GROWTH_INTERVAL_MS = 250;

/** The last point up to this one at which a run has a value: other runs may have points in between. */
function lastKnown(values: ArrayLike<number | null | undefined>, index: number): number {
  let at = index;
  while (at > 0 && values[at] === undefined) at--;
  return at;
}

export class Plot {
  readonly #plot: uPlot;
  readonly #hooks: PlotHooks;
  /** The line at the cycle that the canvas shows. */
  readonly #line = document.createElement("div");
  #now = 0;
  #growthTimer: ReturnType<typeof setTimeout> | null = null;
  #cursor: number | null = null;
  #isOurs = false;

  constructor(
    host: HTMLElement,
    size: { width: number; height: number },
    colors: PlotColors,
    styles: readonly CurveStyle[],
    hooks: PlotHooks,
  ) {
    this.#hooks = hooks;
    const axis: uPlot.Axis = {
      stroke: colors.faint,
      font: "11px system-ui, 'DejaVu Sans', sans-serif",
      grid: { stroke: colors.line, width: 1 },
      ticks: { show: false },
      values: (_, splits) => splits.map(short),
    };
    const options: uPlot.Options = {
      ...size,
      legend: { show: false },
      scales: {
        x: { time: false, range: (_, first, last) => cyclesUpTo(this.#now, first, last) },
        y: { range: (_, low, high) => rangeOf(low, high) },
      },
      axes: [
        { ...axis, size: 26, gap: 5 },
        { ...axis, size: 54, gap: 4 },
      ],
      series: [
        {},
        ...styles.map(({ color, dash }) => ({
          stroke: color,
          width: 1.5,
          dash: [...dash],
          points: { show: false },
          paths: steps,
        })),
      ],
      cursor: {
        y: false,
        drag: { x: false, y: false },
        points: { size: 6, fill: (_, series) => styles[series - 1]?.color ?? colors.ink },
        dataIdx: (plot, series, index) => (series === 0 ? index : lastKnown(plot.data[series]!, index)),
      },
      hooks: {
        setCursor: [(plot) => this.#onCursorMove(plot)],
        draw: [() => this.#placeLine()],
      },
    };
    // uPlot creates its canvas itself, and takes no option for it.
    this.#plot = withCanvasesOnProcessor(() => new uPlot(options, [[], ...styles.map(() => [])], host));
    this.#line.className = "now";
    // Among lines of several colors it is no further one.
    const lineColor = styles.length > 1 ? colors.faint : colors.accent;
    this.#line.style.cssText = `position:absolute;left:0;top:0;width:1px;height:100%;pointer-events:none;background:${lineColor}`;
    this.#plot.over.append(this.#line);
    this.#placeLine();
    this.#plot.over.addEventListener("click", () => {
      const { left } = this.#plot.cursor;
      if (left !== undefined && left >= 0) this.#hooks.onClick(Math.round(this.#plot.posToVal(left, "x")));
    });
  }

  /** Sets the values of all runs, in the order of their styles. */
  setData(curves: readonly Curve[]): void {
    // Where only another run has a value, a line goes on; it ends where its own run has none.
    this.#plot.setData(uPlot.join(curves.map(({ cycles, values }) => [[...cycles], [...values]])));
  }

  setSize(size: { width: number; height: number }): void {
    this.#plot.setSize(size);
  }

  /** Sets the cycle that the canvas shows. */
  setNow(cycle: number): void {
    if (cycle === this.#now) return;
    this.#now = cycle;
    this.#placeLine();
    if (cycle <= (this.#plot.scales.x!.max ?? 0)) return;
    // Setting the data anew sets the range of the cycles anew.
    this.#growthTimer ??= setTimeout(() => {
      this.#growthTimer = null;
      this.#plot.setData(this.#plot.data);
    }, GROWTH_INTERVAL_MS);
  }

  /** Sets the cycle under the pointer of the timeline or another chart. */
  setCursor(cycle: number | null): void {
    if (cycle === this.#cursor) return;
    this.#cursor = cycle;
    this.#isOurs = true;
    const left = cycle === null ? -10 : this.#plot.valToPos(cycle, "x");
    this.#plot.setCursor({ left, top: cycle === null ? -10 : 1 });
    this.#isOurs = false;
  }

  destroy(): void {
    if (this.#growthTimer !== null) clearTimeout(this.#growthTimer);
    this.#plot.destroy();
  }

  #onCursorMove(plot: uPlot): void {
    if (this.#isOurs) return;
    const { left } = plot.cursor;
    const cycle = left === undefined || left < 0 ? null : Math.round(plot.posToVal(left, "x"));
    this.#cursor = cycle;
    this.#hooks.onHover(cycle);
  }

  /** Moves the line to the present cycle; at the right end until the range of the cycles has grown up to it. */
  #placeLine(): void {
    const width_px = this.#plot.bbox.width / devicePixelRatio;
    const x_px = Math.min(width_px - 1, Math.max(0, this.#plot.valToPos(this.#now, "x")));
    this.#line.style.transform = `translateX(${Number.isFinite(x_px) ? x_px : 0}px)`;
  }
}
