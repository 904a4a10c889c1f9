/** One metric against cycles, drawn by uPlot. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { short } from "../format";

export interface PlotColors {
  ink: string;
  faint: string;
  line: string;
  curve: string;
  accent: string;
}

export interface PlotHooks {
  /** Takes the cycle under the pointer; null once it has left. */
  hover(cycle: number | null): void;
  /** Takes a clicked cycle. */
  click(cycle: number): void;
}

/** The range of an axis: round, with zero where it is near, and not empty where nothing changes. */
function rangeOf(lo: number | null, hi: number | null): uPlot.Range.MinMax {
  if (lo === null || hi === null) return [0, 1];
  if (lo === hi) return lo === 0 ? [0, 1] : [lo - 0.5 * Math.abs(lo), hi + 0.5 * Math.abs(hi)];
  return uPlot.rangeNum(lo, hi, 0.1, true);
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
      scales: { x: { time: false }, y: { range: (_, lo, hi) => rangeOf(lo, hi) } },
      axes: [
        { ...axis, size: 26, gap: 5 },
        { ...axis, size: 54, gap: 4 },
      ],
      series: [{}, { stroke: colors.curve, width: 1.5, points: { show: false } }],
      cursor: { y: false, drag: { x: false, y: false }, points: { size: 6, fill: colors.curve } },
      hooks: {
        setCursor: [(plot) => this.#moved(plot)],
        draw: [(plot) => this.#drawNow(plot, colors.accent)],
      },
    };
    this.#plot = new uPlot(options, [[], []], host);
    this.#plot.over.addEventListener("click", () => {
      const { left } = this.#plot.cursor;
      if (left !== undefined && left >= 0) this.#hooks.click(Math.round(this.#plot.posToVal(left, "x")));
    });
  }

  setData(cycles: readonly number[], values: readonly (number | null)[]): void {
    this.#plot.setData([[...cycles], [...values]]);
  }

  setSize(size: { width: number; height: number }): void {
    this.#plot.setSize(size);
  }

  /** The cycle that the canvas shows. */
  setNow(cycle: number): void {
    if (cycle === this.#now) return;
    this.#now = cycle;
    this.#plot.redraw(false);
  }

  /** The cycle that the timeline or another chart points at. */
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

  #moved(plot: uPlot): void {
    if (this.#isOurs) return;
    const { left } = plot.cursor;
    const cycle = left === undefined || left < 0 ? null : Math.round(plot.posToVal(left, "x"));
    this.#cursor = cycle;
    this.#hooks.hover(cycle);
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
