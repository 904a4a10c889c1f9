/** Words over a plan: latitudes and longitudes, data blocks with leader lines, limits of areas, and the profile. */

import { number } from "../format";
import type { Mark, Scene } from "../protocol";
import type { PlaneCamera } from "./camera";
import { nearestPoint, placeBlocks, type BlockRequest, type LastPlaces, type Rect } from "./data-blocks";
import { graticule, type GraticuleLine } from "./graticule";
import { roundUp } from "./grid";
import { css, packColor, ROLES, visibleColor, type Palette } from "./palette";
import { cssOfTint, SYMBOL_PX, type Aircraft, type PlanPainter } from "./plan";
import { levelRange, timeAhead, unitsOf, verticalSymbol, type PlanUnits } from "./plan-units";
import { drawProfile } from "./profile";
import type { Strokes } from "./strokes";
import { areaColor } from "./traffic-areas";

const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";
const BOLD = `600 ${FONT}`;
const LINE_PX = 13;
/** Largest number of data blocks: with more nobody can read them, and placing them takes longer than a picture. */
const MAX_BLOCKS = 80;
/** Width of the edges with the labels of the graticule. */
const LEFT_PX = 4;
const BOTTOM_PX = 20;

/** What the words of a picture depend on. */
export interface WordsContext {
  scene: Scene;
  camera: PlaneCamera;
  painter: PlanPainter;
  palette: Palette;
  size_px: readonly [number, number];
  /** The height of the profile at the bottom; 0 without one. */
  profile_px: number;
  selected: number | undefined;
  hovered: number | undefined;
  /** Marks of the inspection at single places, which would cover aircraft if they were filled. */
  marks: readonly Mark[];
}

interface Block extends BlockRequest {
  aircraft: Aircraft;
  lines: [string, string];
}

/** Draws the lines of a graticule behind a plan. */
export function drawGraticule(strokes: Strokes, lines: readonly GraticuleLine[], palette: Palette): void {
  const tint = packColor(palette.faint, palette.isDark ? 0.22 : 0.25);
  strokes.begin();
  for (const { points_m } of lines) strokes.path(points_m, 1, tint);
  strokes.end();
}

export class PlanWords {
  readonly #units: PlanUnits;
  readonly #last: LastPlaces = new Map();
  /** The scale and the size of the last picture. */
  #lastScale = "";
  /** Number of data blocks of the last picture, and of those without a place. */
  counts = { drawn: 0, leftOut: 0 };

  constructor(scene: Scene) {
    this.#units = unitsOf(scene.traffic!);
  }

  /** Places data blocks anew at the next picture: it shows what it would if it were the first one. */
  forgetPlaces(): void {
    this.#last.clear();
  }

  lines({ scene, camera, size_px }: WordsContext): GraticuleLine[] {
    return graticule(scene.traffic!, camera, size_px);
  }

  draw(pen: CanvasRenderingContext2D, context: WordsContext): void {
    pen.font = FONT;
    pen.textBaseline = "middle";
    const taken = [...this.#drawAreaLabels(pen, context), ...this.#drawNotes(pen, context)];
    this.#drawMarks(pen, context);
    this.#drawBlocks(pen, context, taken);
    if (context.profile_px > 0) drawProfile(pen, context, this.#units);
    this.#drawAxes(pen, context);
    this.#drawScaleBar(pen, context);
  }

  #text(pen: CanvasRenderingContext2D, words: string, x: number, y: number, palette: Palette, ink: string): void {
    pen.lineWidth = 3;
    pen.lineJoin = "round";
    pen.strokeStyle = css(palette.free, 0.85);
    pen.strokeText(words, x, y);
    pen.fillStyle = ink;
    pen.fillText(words, x, y);
  }

  #drawAxes(pen: CanvasRenderingContext2D, context: WordsContext): void {
    const { camera, palette, size_px, profile_px } = context;
    const [width, height] = [size_px[0], size_px[1] - profile_px];
    const ink = css(palette.faint);
    let free = 0;
    for (const { goesUp, label, points_m } of this.lines(context)) {
      const edge = goesUp ? bottomPoint(points_m, camera, height) : points_m[0]!;
      const [x, y] = camera.project(...edge);
      const half = 0.5 * pen.measureText(label).width + 4;
      if (goesUp) {
        if (x - half < Math.max(free, 60) || x + half > width - 100) continue;
        pen.textAlign = "center";
        this.#text(pen, label, x, height - 9, palette, ink);
        free = x + half;
      } else if (y > 52 && y < height - 26) {
        pen.textAlign = "left";
        this.#text(pen, label, LEFT_PX, y, palette, ink);
      }
    }
  }

  #drawScaleBar(pen: CanvasRenderingContext2D, { camera, palette, size_px, profile_px }: WordsContext): void {
    const [unit, unit_m] = this.#units.distance(Math.max(...size_px) * camera.mPerPx);
    const length = roundUp((60 * camera.mPerPx) / unit_m);
    const length_px = (length * unit_m) / camera.mPerPx;
    const [x1, y] = [size_px[0] - 14, size_px[1] - profile_px - 8];
    pen.lineWidth = 1.5;
    pen.strokeStyle = css(palette.ink);
    pen.beginPath();
    pen.moveTo(x1 - length_px, y - 5);
    pen.lineTo(x1 - length_px, y);
    pen.lineTo(x1, y);
    pen.lineTo(x1, y - 5);
    pen.stroke();
    pen.textAlign = "center";
    const words = `${number(Number(length.toPrecision(10)))} ${unit}`;
    this.#text(pen, words, x1 - 0.5 * length_px, y - 11, palette, css(palette.ink));
  }

  /** North, and what vectors mean, in the upper left corner. */
  #drawNotes(pen: CanvasRenderingContext2D, { palette, painter }: WordsContext): Rect[] {
    const ink = css(palette.faint);
    const [x, y] = [14, 10];
    pen.fillStyle = ink;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + 5, y + 15);
    pen.lineTo(x, y + 11);
    pen.lineTo(x - 5, y + 15);
    pen.fill();
    pen.textAlign = "center";
    this.#text(pen, "N", x, y + 23, palette, ink);
    pen.textAlign = "left";
    const words = `vectors: ${timeAhead(painter.lookahead_s)}`;
    this.#text(pen, words, x + 14, y + 8, palette, ink);
    return [{ x: 0, y: 0, width: 30 + pen.measureText(words).width, height: y + 32 }];
  }

  #drawAreaLabels(pen: CanvasRenderingContext2D, { painter, camera, palette }: WordsContext): Rect[] {
    const ink = css(areaColor(palette));
    pen.textAlign = "center";
    return painter.areas.flatMap(({ area, low_m, high_m }): Rect[] => {
      // In the middle of a fence is what it encloses: its words stand below its upper edge.
      const y_m = area.is_fence ? high_m[1] - 1.6 * LINE_PX * camera.mPerPx : 0.5 * (low_m[1] + high_m[1]);
      const [x, y] = camera.project(0.5 * (low_m[0] + high_m[0]), y_m);
      const limits = levelRange(this.#units, area.low_m, area.high_m);
      pen.font = BOLD;
      const half = 0.5 * Math.max(pen.measureText(area.name).width, pen.measureText(limits).width);
      // The words of an area that is smaller than they are would hide it.
      if ((high_m[0] - low_m[0]) / camera.mPerPx < half) return [];
      this.#text(pen, area.name, x, y - 0.5 * LINE_PX, palette, ink);
      pen.font = FONT;
      this.#text(pen, limits, x, y + 0.5 * LINE_PX, palette, ink);
      return [{ x: x - half, y: y - LINE_PX, width: 2 * half, height: 2 * LINE_PX }];
    });
  }

  /** Rings around places that the selected aircraft knows or is grouped with: nothing is covered. */
  #drawMarks(pen: CanvasRenderingContext2D, { marks, camera, palette }: WordsContext): void {
    for (const { role, shape } of marks) {
      if (shape.type !== "point") continue;
      const [x, y] = camera.project(shape.at_m[0], shape.at_m[1]);
      pen.strokeStyle = css(visibleColor(ROLES[role].color, palette), 0.9);
      pen.lineWidth = 1.3;
      pen.setLineDash(ROLES[role].dashed ? [3, 3] : []);
      pen.beginPath();
      pen.arc(x, y, 1.7 * SYMBOL_PX, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  #drawBlocks(pen: CanvasRenderingContext2D, context: WordsContext, taken: Rect[]): void {
    const { camera, palette, painter, size_px, profile_px } = context;
    const blocks = this.#blocks(pen, context);
    const ahead_s = painter.lookahead_s;
    const vectors = blocks.flatMap(({ aircraft: { x_m, y_m, velocity_m_s: v }, x, y }) => {
      if (!v) return [];
      const [x1, y1] = camera.project(x_m + ahead_s * v[0], y_m + ahead_s * v[1]);
      return [[[x, y], [x1, y1]] as const]; // prettier-ignore
    });
    const area = { x: LEFT_PX, y: 2, width: size_px[0] - 8, height: size_px[1] - profile_px - BOTTOM_PX };
    const obstacles = { area, taken, vectors, symbol_px: SYMBOL_PX };
    // At another scale blocks move against their aircraft anyway: the picture does not depend on how it was reached.
    const scale = [camera.mPerPx, ...size_px, profile_px].join();
    if (scale !== this.#lastScale) this.#last.clear();
    this.#lastScale = scale;
    const placed = placeBlocks(blocks.slice(0, MAX_BLOCKS), obstacles, LINE_PX, this.#last);
    this.counts = { drawn: placed.length, leftOut: blocks.length - placed.length };
    pen.textAlign = "left";
    for (const { request, rect } of placed) {
      const { aircraft, lines, x, y } = request as Block;
      const [endX, endY] = nearestPoint(rect, x, y);
      const length = Math.hypot(endX - x, endY - y);
      const gap = SYMBOL_PX + 2;
      if (length > gap) {
        pen.strokeStyle = cssOfTint(painter.tintOf(aircraft.index));
        pen.lineWidth = 0.8;
        pen.beginPath();
        pen.moveTo(x + (gap / length) * (endX - x), y + (gap / length) * (endY - y));
        pen.lineTo(endX, endY);
        pen.stroke();
      }
      const ink = painter.inkOf(aircraft, palette);
      pen.font = BOLD;
      this.#text(pen, lines[0], rect.x, rect.y + 0.5 * LINE_PX, palette, ink);
      pen.font = FONT;
      this.#text(pen, lines[1], rect.x, rect.y + 1.5 * LINE_PX, palette, ink);
    }
    if (this.counts.leftOut > 0) this.#drawLeftOut(pen, context);
  }

  #drawLeftOut(pen: CanvasRenderingContext2D, { palette, size_px }: WordsContext): void {
    const { drawn, leftOut } = this.counts;
    const words = `${drawn} of ${drawn + leftOut} data blocks: zoom in for the others`;
    if (size_px[0] < pen.measureText(words).width + 40) return;
    pen.textAlign = "left";
    this.#text(pen, words, 28, 32, palette, css(palette.faint));
  }

  /** The aircraft in the picture: the selected one first, then those in conflict. */
  #blocks(pen: CanvasRenderingContext2D, context: WordsContext): Block[] {
    const { camera, painter, size_px, profile_px, selected, hovered } = context;
    const rank = ({ index, isAlert }: Aircraft): number =>
      index === selected ? 0 : index === hovered ? 1 : isAlert ? 2 : 3;
    const { bodies } = painter;
    // Before the first frame nobody is known.
    if (!bodies || painter.hidesAgents) return [];
    const shown = painter.aircraft();
    const { number: numbers } = bodies.table;
    const all = shown.sort((a, b) => rank(a) - rank(b) || a.index - b.index);
    return all.flatMap((aircraft): Block[] => {
      const [x, y] = camera.project(aircraft.x_m, aircraft.y_m);
      if (x < 0 || y < 0 || x > size_px[0] || y > size_px[1] - profile_px) return [];
      const lines = this.#linesOf(aircraft, bodies.name(aircraft.index));
      pen.font = BOLD;
      const first = pen.measureText(lines[0]).width;
      pen.font = FONT;
      const width = Math.max(first, pen.measureText(lines[1]).width);
      // Indices shift as others come and go: a block keeps its place by the number of its aircraft.
      return [{ key: numbers[aircraft.index]!, x, y, width, height: 2 * LINE_PX, aircraft, lines }];
    });
  }

  #linesOf({ altitude_m, velocity_m_s }: Aircraft, name: string): [string, string] {
    const level = this.#units.level(altitude_m);
    if (!velocity_m_s) return [name, level];
    const speed = this.#units.speed(Math.hypot(velocity_m_s[0], velocity_m_s[1]));
    return [name, `${level}${verticalSymbol(velocity_m_s[2])} ${speed}`];
  }
}

/** The point of a line at the lower edge of the plan, above the profile. */
function bottomPoint(points_m: readonly [number, number][], camera: PlaneCamera, height_px: number): [number, number] {
  const [, edge_m] = camera.at(0, height_px);
  for (let i = 1; i < points_m.length; i++) {
    const [[ax, ay], [bx, by]] = [points_m[i - 1]!, points_m[i]!];
    if (ay <= edge_m && by > edge_m) return [ax + ((edge_m - ay) / (by - ay)) * (bx - ax), edge_m];
  }
  return points_m[0]!;
}
