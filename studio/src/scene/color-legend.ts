/** The legend of colors in an image: as the page shows it beside the canvas. */

import { number } from "../format";
import type { ColorLegend } from "./coloring";
import { css, type Palette } from "./palette";
import { grayOf, scaleColor } from "./scale";

/** Categories that are listed; those beyond share their colors with these. */
export const MAX_ENTRIES = 8;
/** Steps of the bar of a scale. */
export const STOPS = 12;

const BOLD = "600 12px system-ui, 'DejaVu Sans', sans-serif";
const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";
const SMALL = "11px system-ui, 'DejaVu Sans', sans-serif";
const LINE_PX = 17;
const PADDING_PX = 8;
const RIGHT_PX = 8;
/** Below it is the scale bar. */
const BOTTOM_PX = 34;
const SWATCH_PX = 11;
const GAP_PX = 6;
const BAR_PX = 10;
const MIN_WIDTH_PX = 132;

type Pen = CanvasRenderingContext2D;
type Scale = Extract<ColorLegend, { kind: "scale" }>;

/** The part of an image above the profile, and its colors. */
export interface LegendPlace {
  width_px: number;
  height_px: number;
  palette: Palette;
}

/** A line of a legend: a text, with a swatch before it and a number at its end, or the bar of a scale. */
interface Line {
  words: string;
  font: string;
  isFaint: boolean;
  swatch: string | null;
  count: string;
  isBar: boolean;
}

function textLine(words: string, line: Partial<Line> = {}): Line {
  return { words, font: FONT, isFaint: false, swatch: null, count: "", isBar: false, ...line };
}

/** The lines of a legend, in their order. */
export function legendLines(legend: ColorLegend, palette: Palette): Line[] {
  if (legend.kind === "scale") return scaleLines(legend, palette);
  const entries = legend.entries
    .slice(0, MAX_ENTRIES)
    .map(({ name, color, count }) => textLine(name, { swatch: css(color), count: number(count) }));
  const rest = legend.entries.length - MAX_ENTRIES;
  const restWords = `and ${rest} more, in the same colors again`;
  const note = rest > 0 ? [textLine(restWords, { font: SMALL, isFaint: true })] : [];
  return [textLine(legend.title, { font: BOLD }), ...entries, ...note];
}

function scaleLines({ title, unit, ends, note, hasNone }: Scale, palette: Palette): Line[] {
  const lines = [textLine(unit === "" ? title : `${title}, ${unit}`, { font: BOLD }), textLine("", { isBar: true })];
  lines.push(textLine(number(ends[0]), { font: SMALL, count: number(ends[1]) }));
  if (note !== "") lines.push(textLine(note, { font: SMALL, isFaint: true }));
  if (hasNone) lines.push(textLine("no value", { font: SMALL, swatch: css(grayOf(palette)) }));
  return lines;
}

/** Draws the legend of colors into the lower right corner; nothing where bodies have their own colors. */
export function drawColorLegend(pen: Pen, legend: ColorLegend | null, place: LegendPlace): void {
  if (!legend) return;
  const { palette } = place;
  const lines = legendLines(legend, palette);
  const widths = lines.map((line) => widthOf(pen, line));
  const width = Math.max(MIN_WIDTH_PX, Math.max(...widths) + 2 * PADDING_PX);
  const height = lines.length * LINE_PX + PADDING_PX;
  const left = place.width_px - RIGHT_PX - width;
  const top = place.height_px - BOTTOM_PX - height;
  pen.setLineDash([]);
  pen.lineWidth = 1;
  pen.fillStyle = css(palette.free, 0.95);
  pen.strokeStyle = css(palette.faint, 0.6);
  pen.fillRect(left, top, width, height);
  pen.strokeRect(left + 0.5, top + 0.5, width - 1, height - 1);
  pen.textBaseline = "middle";
  lines.forEach((line, index) => {
    const y = top + PADDING_PX / 2 + (index + 0.5) * LINE_PX;
    const [from, until] = [left + PADDING_PX, left + width - PADDING_PX];
    if (line.isBar) drawBar(pen, from, y, until - from, palette);
    else drawLine(pen, line, { from, until, y }, palette);
  });
}

function widthOf(pen: Pen, { words, font, swatch, count }: Line): number {
  pen.font = font;
  const swatch_px = swatch === null ? 0 : SWATCH_PX + GAP_PX;
  const count_px = count === "" ? 0 : 2 * GAP_PX + pen.measureText(count).width;
  return swatch_px + pen.measureText(words).width + count_px;
}

function drawBar(pen: Pen, left: number, y: number, width_px: number, palette: Palette): void {
  const gradient = pen.createLinearGradient(left, 0, left + width_px, 0);
  for (let stop = 0; stop <= STOPS; stop++) gradient.addColorStop(stop / STOPS, css(scaleColor(stop / STOPS, palette)));
  pen.fillStyle = gradient;
  pen.fillRect(left, y - BAR_PX / 2, width_px, BAR_PX);
}

function drawLine(pen: Pen, line: Line, at: { from: number; until: number; y: number }, palette: Palette): void {
  let x = at.from;
  if (line.swatch !== null) {
    pen.fillStyle = line.swatch;
    pen.fillRect(x, at.y - SWATCH_PX / 2, SWATCH_PX, SWATCH_PX);
    x += SWATCH_PX + GAP_PX;
  }
  pen.font = line.font;
  pen.fillStyle = css(line.isFaint ? palette.faint : palette.ink);
  pen.textAlign = "left";
  pen.fillText(line.words, x, at.y);
  pen.textAlign = "right";
  pen.fillText(line.count, at.until, at.y);
}
