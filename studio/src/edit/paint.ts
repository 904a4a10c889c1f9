/** Draws the edited items over the scene: boxes, outlines, handles and the cursor. */

import type { Point3 } from "../protocol";
import type { Camera } from "../scene/camera";
import { css, mix, ROLES, visibleColor, type Palette, type Rgb } from "../scene/palette";
import { cornerPosition, type AsciiMap, type GridPlacement, type MapChar } from "./ascii-map";
import { AXIS_NAMES, handlesAt } from "./axes";
import type { Cell } from "./cells";
import type { Item } from "./tools/item";

/** Minimum size of boxes for grid lines, which would hide smaller ones. */
const MIN_BOX_PX = 5;
export const HANDLE_PX = 6;

export interface Sketch {
  map: AsciiMap | null;
  ground: GridPlacement | null;
  /** Boxes of the text that the scene does not show yet, as while the text is invalid. */
  changedCells: readonly Cell[];
  items: readonly Item[];
  selected: Item | null;
  /** Items with problems. */
  invalid: ReadonlySet<Item>;
  /** Boxes that a stroke would draw, and their character. */
  cells: readonly Cell[];
  mark: MapChar | null;
  /** The stroke from press to release, for tools that draw more than boxes. */
  stroke: readonly [Point3, Point3] | null;
  shape: "circle" | "line" | "box" | null;
  /** The dragged item, and its displacement. */
  dragged: { item: Item; by: Point3 } | null;
  /** The position of the axis handles, in space. */
  axesAt: Point3 | null;
  cursor: Point3 | null;
}

export class Sketcher {
  readonly #pen: CanvasRenderingContext2D;
  readonly #camera: Camera;
  readonly #palette: Palette;

  constructor(pen: CanvasRenderingContext2D, camera: Camera, palette: Palette) {
    this.#pen = pen;
    this.#camera = camera;
    this.#palette = palette;
  }

  draw(sketch: Sketch, width_px: number, height_px: number): void {
    this.#pen.clearRect(0, 0, width_px, height_px);
    const { ground, map } = sketch;
    if (map && ground) this.#changed(map, ground, sketch.changedCells);
    if (map && ground) this.#lines(ground, width_px, height_px);
    if (ground) this.#cells(ground, sketch.cells, sketch.mark);
    for (const item of sketch.items) this.#item(item, item === sketch.selected, sketch.invalid.has(item), [0, 0, 0]);
    if (sketch.dragged) this.#item(sketch.dragged.item, true, false, sketch.dragged.by);
    if (sketch.axesAt) this.#axes(sketch.axesAt);
    if (sketch.stroke && sketch.shape) this.#stroke(...sketch.stroke, sketch.shape);
    if (sketch.cursor) this.#cursor(sketch.cursor);
  }

  #px(at: Point3): [number, number] {
    const [px, py] = this.#camera.project(...at);
    return [px, py];
  }

  #trace(points: readonly Point3[], isClosed: boolean): void {
    const pen = this.#pen;
    pen.beginPath();
    points.forEach((point, i) => (i === 0 ? pen.moveTo(...this.#px(point)) : pen.lineTo(...this.#px(point))));
    if (isClosed) pen.closePath();
  }

  #corners(ground: GridPlacement, [column, row]: Cell): Point3[] {
    return [
      [0, 0],
      [1, 0],
      [1, 1],
      [0, 1],
    ].map(([i, j]) => cornerPosition(ground, column + i!, row + j!));
  }

  #colorOf(mark: MapChar): Rgb {
    if (mark === "#") return this.#palette.wall;
    return mark === "." ? this.#palette.free : this.#palette.unknown;
  }

  #changed(map: AsciiMap, ground: GridPlacement, cells: readonly Cell[]): void {
    for (const cell of cells) {
      const mark = map.charAt(cell);
      if (mark !== undefined) this.#fill(this.#corners(ground, cell), css(this.#colorOf(mark)));
    }
  }

  #fill(points: readonly Point3[], style: string): void {
    this.#trace(points, true);
    this.#pen.fillStyle = style;
    this.#pen.fill();
  }

  #lines(ground: GridPlacement, width_px: number, height_px: number): void {
    if (ground.box_m / this.#camera.mPerPx < MIN_BOX_PX) return;
    const pen = this.#pen;
    pen.beginPath();
    const piece = (a: Point3, b: Point3): void => {
      const [[x0, y0], [x1, y1]] = [this.#px(a), this.#px(b)];
      if (Math.max(x0, x1) < 0 || Math.min(x0, x1) > width_px || Math.max(y0, y1) < 0 || Math.min(y0, y1) > height_px)
        return;
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
    };
    for (let c = 0; c <= ground.width; c++)
      piece(cornerPosition(ground, c, 0), cornerPosition(ground, c, ground.height));
    for (let r = 0; r <= ground.height; r++)
      piece(cornerPosition(ground, 0, r), cornerPosition(ground, ground.width, r));
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.strokeStyle = css(this.#palette.faint, 0.28);
    pen.stroke();
  }

  #cells(ground: GridPlacement, cells: readonly Cell[], mark: MapChar | null): void {
    const color = mark === null ? this.#palette.accent : mix(this.#colorOf(mark), this.#palette.accent, 0.45);
    for (const cell of cells) this.#fill(this.#corners(ground, cell), css(color, 0.75));
  }

  #item(item: Item, isChosen: boolean, isWrong: boolean, by: Point3): void {
    const [, , inFront] = this.#camera.project(...item.at_m);
    if (!inFront) return;
    const pen = this.#pen;
    const color = isWrong
      ? ROLES.refused.color
      : item.kind === "goal"
        ? ROLES.target.color
        : item.kind === "area"
          ? ROLES.claim.color
          : ROLES.done.color;
    const at = (p: Point3): Point3 => [p[0] + by[0], p[1] + by[1], p[2] + by[2]];
    const ink = css(visibleColor(color, this.#palette));
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

  /** Draws goals as diamonds, corners as squares, starts and bodies as discs. */
  #handle(at: Point3, item: Item, ink: string, isChosen: boolean): void {
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

  /** Draws arrows along the axes, with their letters. */
  #axes(at: Point3): void {
    const pen = this.#pen;
    const colors: readonly Rgb[] = [ROLES.refused.color, ROLES.true.color, ROLES.wish.color];
    for (const { axis, tip_m } of handlesAt(this.#camera, at)) {
      const [[x, y], [tx, ty]] = [this.#px(at), this.#px(tip_m)];
      const color = css(visibleColor(colors[axis]!, this.#palette));
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

  #flag(at: Point3): void {
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

  #stroke(from: Point3, to: Point3, shape: "circle" | "line" | "box"): void {
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

  #cursor(at: Point3): void {
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

/** Boxes that differ from the shown floor of the same size, given as codes; all if none is shown. */
export function changedCells(map: AsciiMap, shown: Uint8Array | null): Cell[] {
  const cells: Cell[] = [];
  for (let row = 0; row < map.height; row++) {
    for (let column = 0; column < map.width; column++) {
      const mark = map.charAt([column, row]);
      const now = shown?.[row * map.width + column];
      // The scenario determines the meaning of unknown boxes.
      const isShown = now !== undefined && (mark === "?" || (now === 1) === (mark === "#"));
      if (!isShown) cells.push([column, row]);
    }
  }
  return cells;
}

/** The item at a point of the canvas: handles first, then bodies and areas. */
export function itemAt(items: readonly Item[], camera: Camera, x_px: number, y_px: number): Item | null {
  const px = (at: Point3): [number, number] => {
    const [x, y] = camera.project(...at);
    return [x, y];
  };
  const near = ({ at_m }: Item, within: number): boolean =>
    camera.project(...at_m)[2] && Math.hypot(px(at_m)[0] - x_px, px(at_m)[1] - y_px) <= within;
  const byHandle = items.findLast((item) => item.kind !== "area" && item.kind !== "body" && near(item, HANDLE_PX + 4));
  if (byHandle) return byHandle;
  const bodies = items.filter((item) => item.kind === "body" || item.kind === "area");
  const isOn = (item: Item): boolean => {
    const outline = item.outline_m.map(px);
    return (
      near(item, HANDLE_PX + 2) ||
      (item.kind === "body" && item.isClosed && isInside(outline, x_px, y_px)) ||
      isNearOutline(outline, item.isClosed, x_px, y_px)
    );
  };
  return bodies.findLast((item) => item.kind === "body" && isOn(item)) ?? bodies.findLast(isOn) ?? null;
}

function isInside(corners: readonly [number, number][], x: number, y: number): boolean {
  let isInside = false;
  corners.forEach(([x1, y1], i) => {
    const [x0, y0] = corners.at(i - 1)!;
    if (y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0)) isInside = !isInside;
  });
  return isInside;
}

/** Returns whether a point is on an outline, within a few pixels. */
function isNearOutline(points: readonly [number, number][], isClosed: boolean, x: number, y: number): boolean {
  return points.some(([x1, y1], i) => {
    if (i === 0 && !isClosed) return false;
    const [x0, y0] = points.at(i - 1)!;
    const length2 = (x1 - x0) ** 2 + (y1 - y0) ** 2;
    const fraction =
      length2 === 0 ? 0 : Math.min(1, Math.max(0, ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length2));
    return Math.hypot(x0 + fraction * (x1 - x0) - x, y0 + fraction * (y1 - y0) - y) <= 5;
  });
}
