/** Draws the edited things over the picture: boxes, outlines, handles and the cursor. */

import type { Place } from "../protocol";
import type { Eye } from "../scene/camera";
import { css, mixed, ROLES, visible, type Palette, type Rgb } from "../scene/palette";
import { placeOf, type Board, type Ground, type Mark } from "./board";
import { AXIS_NAMES, handlesAt } from "./axes";
import type { Cell } from "./cells";
import type { Item } from "./tools/item";

/** Lines between boxes that are smaller than this would hide them. */
const LEAST_BOX_PX = 5;
export const HANDLE_PX = 6;

export interface Sketch {
  board: Board | null;
  ground: Ground | null;
  /** Boxes of the text that the picture does not show yet, as while the text is not valid. */
  changed: readonly Cell[];
  items: readonly Item[];
  chosen: Item | null;
  /** Items with problems. */
  wrong: ReadonlySet<Item>;
  /** Boxes that a stroke would draw, and their mark. */
  cells: readonly Cell[];
  mark: Mark | null;
  /** The stroke from press to release, where it is more than boxes. */
  stroke: readonly [Place, Place] | null;
  shape: "circle" | "line" | "box" | null;
  /** The dragged item, and how far it would be moved. */
  shifted: { item: Item; by: Place } | null;
  /** The place of the handles of the axes, in space. */
  axesAt: Place | null;
  cursor: Place | null;
}

export class Sketcher {
  readonly #pen: CanvasRenderingContext2D;
  readonly #eye: Eye;
  readonly #palette: Palette;

  constructor(pen: CanvasRenderingContext2D, eye: Eye, palette: Palette) {
    this.#pen = pen;
    this.#eye = eye;
    this.#palette = palette;
  }

  draw(sketch: Sketch, width_px: number, height_px: number): void {
    this.#pen.clearRect(0, 0, width_px, height_px);
    const { ground, board } = sketch;
    if (board && ground) this.#changed(board, ground, sketch.changed);
    if (board && ground) this.#lines(ground, width_px, height_px);
    if (ground) this.#cells(ground, sketch.cells, sketch.mark);
    for (const item of sketch.items) this.#item(item, item === sketch.chosen, sketch.wrong.has(item), [0, 0, 0]);
    if (sketch.shifted) this.#item(sketch.shifted.item, true, false, sketch.shifted.by);
    if (sketch.axesAt) this.#axes(sketch.axesAt);
    if (sketch.stroke && sketch.shape) this.#stroke(...sketch.stroke, sketch.shape);
    if (sketch.cursor) this.#cursor(sketch.cursor);
  }

  #px(at: Place): [number, number] {
    const [px, py] = this.#eye.project(...at);
    return [px, py];
  }

  #trace(points: readonly Place[], isClosed: boolean): void {
    const pen = this.#pen;
    pen.beginPath();
    points.forEach((point, i) => (i === 0 ? pen.moveTo(...this.#px(point)) : pen.lineTo(...this.#px(point))));
    if (isClosed) pen.closePath();
  }

  #corners(ground: Ground, [column, row]: Cell): Place[] {
    return [
      [0, 0],
      [1, 0],
      [1, 1],
      [0, 1],
    ].map(([i, j]) => placeOf(ground, column + i!, row + j!));
  }

  #colorOf(mark: Mark): Rgb {
    if (mark === "#") return this.#palette.wall;
    return mark === "." ? this.#palette.free : this.#palette.unknown;
  }

  #changed(board: Board, ground: Ground, cells: readonly Cell[]): void {
    for (const cell of cells) {
      const mark = board.markAt(cell);
      if (mark !== undefined) this.#fill(this.#corners(ground, cell), css(this.#colorOf(mark)));
    }
  }

  #fill(points: readonly Place[], style: string): void {
    this.#trace(points, true);
    this.#pen.fillStyle = style;
    this.#pen.fill();
  }

  #lines(ground: Ground, width_px: number, height_px: number): void {
    if (ground.box_m / this.#eye.mPerPx < LEAST_BOX_PX) return;
    const pen = this.#pen;
    pen.beginPath();
    const piece = (a: Place, b: Place): void => {
      const [[x0, y0], [x1, y1]] = [this.#px(a), this.#px(b)];
      if (Math.max(x0, x1) < 0 || Math.min(x0, x1) > width_px || Math.max(y0, y1) < 0 || Math.min(y0, y1) > height_px)
        return;
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
    };
    for (let c = 0; c <= ground.width; c++) piece(placeOf(ground, c, 0), placeOf(ground, c, ground.height));
    for (let r = 0; r <= ground.height; r++) piece(placeOf(ground, 0, r), placeOf(ground, ground.width, r));
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.strokeStyle = css(this.#palette.faint, 0.28);
    pen.stroke();
  }

  #cells(ground: Ground, cells: readonly Cell[], mark: Mark | null): void {
    const color = mark === null ? this.#palette.accent : mixed(this.#colorOf(mark), this.#palette.accent, 0.45);
    for (const cell of cells) this.#fill(this.#corners(ground, cell), css(color, 0.75));
  }

  #item(item: Item, isChosen: boolean, isWrong: boolean, by: Place): void {
    const [, , inFront] = this.#eye.project(...item.at_m);
    if (!inFront) return;
    const pen = this.#pen;
    const color = isWrong
      ? ROLES.refused.color
      : item.kind === "goal"
        ? ROLES.target.color
        : item.kind === "area"
          ? ROLES.claim.color
          : ROLES.done.color;
    const at = (p: Place): Place => [p[0] + by[0], p[1] + by[1], p[2] + by[2]];
    const ink = css(visible(color, this.#palette));
    pen.strokeStyle = ink;
    pen.lineWidth = isChosen ? 3.5 : 1.5;
    pen.setLineDash(item.kind === "area" || item.kind === "start" ? [6, 4] : []);
    if (item.outline_m.length > 1) {
      this.#trace(item.outline_m.map(at), item.isClosed);
      pen.stroke();
    }
    pen.setLineDash([]);
    const hasHandle = item.kind === "goal" || item.kind === "point" || item.kind === "start" || isChosen;
    if (hasHandle) this.#handle(at(item.at_m), item, ink, isChosen);
    if (isWrong) this.#flag(at(item.at_m));
  }

  /** Goals are diamonds, corners squares, starts and bodies discs. */
  #handle(at: Place, item: Item, ink: string, isChosen: boolean): void {
    const pen = this.#pen;
    const [x, y] = this.#px(at);
    const r = HANDLE_PX * (isChosen ? 1.2 : 0.9);
    pen.beginPath();
    if (item.kind === "goal")
      for (const [i, j] of [
        [0, -1.3],
        [1.3, 0],
        [0, 1.3],
        [-1.3, 0],
      ])
        pen.lineTo(x + i! * r, y + j! * r);
    else if (item.kind === "point") pen.rect(x - 0.8 * r, y - 0.8 * r, 1.6 * r, 1.6 * r);
    else pen.arc(x, y, r, 0, 2 * Math.PI);
    pen.closePath();
    pen.fillStyle = css(this.#palette.free, 0.9);
    pen.fill();
    pen.lineWidth = isChosen ? 3.5 : 2;
    pen.strokeStyle = ink;
    pen.stroke();
  }

  /** Arrows along the axes, with their letters. */
  #axes(at: Place): void {
    const pen = this.#pen;
    const colors: readonly Rgb[] = [ROLES.refused.color, ROLES.true.color, ROLES.wish.color];
    for (const { axis, tip_m } of handlesAt(this.#eye, at)) {
      const [[x, y], [tx, ty]] = [this.#px(at), this.#px(tip_m)];
      const color = css(visible(colors[axis]!, this.#palette));
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(tx, ty);
      pen.lineWidth = 2.5;
      pen.strokeStyle = color;
      pen.stroke();
      pen.beginPath();
      pen.arc(tx, ty, HANDLE_PX + 2, 0, 2 * Math.PI);
      pen.fillStyle = color;
      pen.fill();
      pen.font = "bold 11px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillStyle = "#000";
      pen.fillText(AXIS_NAMES[axis], tx, ty + 0.5);
    }
  }

  #flag(at: Place): void {
    const pen = this.#pen;
    const [x, y] = this.#px(at);
    pen.beginPath();
    pen.arc(x + 10, y - 10, 8, 0, 2 * Math.PI);
    pen.fillStyle = css(ROLES.refused.color);
    pen.fill();
    pen.font = "bold 12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = "#000";
    pen.fillText("!", x + 10, y - 9.5);
  }

  #stroke(from: Place, to: Place, shape: "circle" | "line" | "box"): void {
    const pen = this.#pen;
    const [[x0, y0], [x1, y1]] = [this.#px(from), this.#px(to)];
    pen.beginPath();
    if (shape === "circle") pen.arc(x0, y0, Math.hypot(x1 - x0, y1 - y0), 0, 2 * Math.PI);
    else if (shape === "box") pen.rect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
    else pen.lineTo(x0, y0);
    if (shape === "line") pen.lineTo(x1, y1);
    pen.lineWidth = 2;
    pen.setLineDash([5, 4]);
    pen.strokeStyle = css(this.#palette.accent);
    pen.stroke();
    pen.setLineDash([]);
  }

  #cursor(at: Place): void {
    const pen = this.#pen;
    const [x, y] = this.#px(at);
    for (const [width, style] of [
      [5, css(this.#palette.free, 0.9)],
      [2, css(this.#palette.accent)],
    ] as const) {
      pen.beginPath();
      for (const [i, j] of [
        [-1, 0],
        [1, 0],
        [0, -1],
        [0, 1],
      ] as const) {
        pen.moveTo(x + 4 * i, y + 4 * j);
        pen.lineTo(x + 13 * i, y + 13 * j);
      }
      pen.lineWidth = width;
      pen.strokeStyle = style;
      pen.stroke();
    }
  }
}

/** Boxes that differ from those in the picture: codes of a floor of the same size, if it shows one. */
export function changedCells(board: Board, shown: Uint8Array | null): Cell[] {
  const cells: Cell[] = [];
  for (let row = 0; row < board.height; row++) {
    for (let column = 0; column < board.width; column++) {
      const mark = board.markAt([column, row]);
      const now = shown?.[row * board.width + column];
      // The scenario chooses the meaning of unknown boxes.
      const isShown = now !== undefined && (mark === "?" || (now === 1) === (mark === "#"));
      if (!isShown) cells.push([column, row]);
    }
  }
  return cells;
}

/** The item at a point of the canvas: handles first, then the items under them. */
export function itemAt(items: readonly Item[], eye: Eye, x_px: number, y_px: number): Item | null {
  const px = (at: Place): [number, number] => {
    const [x, y] = eye.project(...at);
    return [x, y];
  };
  const near = ({ at_m }: Item, within: number): boolean =>
    eye.project(...at_m)[2] && Math.hypot(px(at_m)[0] - x_px, px(at_m)[1] - y_px) <= within;
  const byHandle = items.findLast((item) => item.kind !== "area" && item.kind !== "body" && near(item, HANDLE_PX + 4));
  if (byHandle) return byHandle;
  const bodies = items.filter((item) => item.kind === "body" || item.kind === "area");
  const isOn = (item: Item): boolean => {
    const outline = item.outline_m.map(px);
    return (
      near(item, HANDLE_PX + 2) ||
      (item.kind === "body" && item.isClosed && holds(outline, x_px, y_px)) ||
      isBeside(outline, item.isClosed, x_px, y_px)
    );
  };
  return bodies.findLast((item) => item.kind === "body" && isOn(item)) ?? bodies.findLast(isOn) ?? null;
}

function holds(corners: readonly [number, number][], x: number, y: number): boolean {
  let isInside = false;
  corners.forEach(([x1, y1], i) => {
    const [x0, y0] = corners.at(i - 1)!;
    if (y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0)) isInside = !isInside;
  });
  return isInside;
}

/** Returns whether a point lies on a line, within a few pixels. */
function isBeside(points: readonly [number, number][], isClosed: boolean, x: number, y: number): boolean {
  return points.some(([x1, y1], i) => {
    if (i === 0 && !isClosed) return false;
    const [x0, y0] = points.at(i - 1)!;
    const length2 = (x1 - x0) ** 2 + (y1 - y0) ** 2;
    const share = length2 === 0 ? 0 : Math.min(1, Math.max(0, ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length2));
    return Math.hypot(x0 + share * (x1 - x0) - x, y0 + share * (y1 - y0) - y) <= 5;
  });
}
