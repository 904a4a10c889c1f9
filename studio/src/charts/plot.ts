/** One metric against cycles, drawn by uPlot. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { short } from "../format";
import { isConstant } from "../rounding";

export interface PlotColors {
  ink: string;
  faint: string;
  line: string;
  curve: string;
  accent: string;
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

export class Plot {
  readonly #plot: uPlot;
  readonly #hooks: PlotHooks;
  #now = 0;
  #cursor: number | null = null;
  #isOurs = false;

  constructor(host: HTMLElement, size: { width: number; height: number }, colors: PlotColors, hooks: PlotHooks) {
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
      series: [{}, { stroke: colors.curve, width: 1.5, points: { show: false }, paths: steps }],
      cursor: { y: false, drag: { x: false, y: false }, points: { size: 6, fill: colors.curve } },
      hooks: {
        setCursor: [(plot) => this.#onCursorMove(plot)],
        draw: [(plot) => this.#drawNow(plot, colors.accent)],
      },
    };
    this.#plot = new uPlot(options, [[], []], host);
    this.#plot.over.addEventListener("click", () => {
      const { left } = this.#plot.cursor;
      if (left !== undefined && left >= 0) this.#hooks.onClick(Math.round(this.#plot.posToVal(left, "x")));
    });
  }

  setData(cycles: readonly number[], values: readonly (number | null)[]): void {
    this.#plot.setData([[...cycles], [...values]]);
  }

  setSize(size: { width: number; height: number }): void {
    this.#plot.setSize(size);
  }

  /** Sets the cycle that the canvas shows. */
  setNow(cycle: number): void {
    if (cycle === this.#now) return;
    const isBeyond = cycle > (this.#plot.scales.x!.max ?? 0);
    this.#now = cycle;
    // Setting the data anew sets the range of the cycles anew.
    if (isBeyond) this.#plot.setData(this.#plot.data);
    else this.#plot.redraw(false);
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
    this.#plot.destroy();
  }

  #onCursorMove(plot: uPlot): void {
    if (this.#isOurs) return;
    const { left } = plot.cursor;
    const cycle = left === undefined || left < 0 ? null : Math.round(plot.posToVal(left, "x"));
    this.#cursor = cycle;
    this.#hooks.onHover(cycle);
  }

  #drawNow(plot: uPlot, color: string): void {
    const x = plot.valToPos(this.#now, "x", true);
    const { left, width, top, height } = plot.bbox;
    if (!(x >= left && x <= left + width)) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = color;
    plot.ctx.lineWidth = devicePixelRatio;
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}
