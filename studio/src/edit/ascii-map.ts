/**
 * The drawn map of a scenario of robots: `map.ascii`. Its first line is the north edge; boxes count columns from the west
 * and rows from the south, like all positions of the scenario, and box (0, 0) starts at the origin.
 */

import type { OccupancyGrid, Point3 } from "../protocol";
import type { Cell } from "./cells";
import { keyOf, valueAt, type TomlTable } from "./keypath";
import type { Edit } from "../protocol";

export type MapChar = "#" | "." | "?";

/** Side of a box unless the scenario gives it. */
const DEFAULT_BOX_M = 0.25;
/** Maximum number of boxes of a map in a text that people read. */
export const MAX_BOXES = 250_000;

export class AsciiMap {
  readonly width: number;
  readonly height: number;
  readonly box_m: number;
  readonly #lines: string[];
  /** Lines of the text before the first of the map. */
  readonly #skipped: number;

  constructor(ascii: string, box_m: number) {
    this.#skipped = /^\r?\n/.test(ascii) ? 1 : 0;
    this.#lines = ascii
      .replace(/^\r?\n/, "")
      .replace(/[\r\n]+$/, "")
      .split(/\r?\n/);
    this.width = this.#lines[0]!.length;
    this.height = this.#lines.length;
    this.box_m = box_m;
  }

  /** The drawn map of a scenario, if it has one. */
  static fromModel(model: TomlTable | null): AsciiMap | null {
    const ascii = valueAt(model ?? {}, ["map", "ascii"]);
    const box_m = valueAt(model ?? {}, ["map", "box_size_m"]) ?? DEFAULT_BOX_M;
    return typeof ascii === "string" && ascii.trim() !== "" && typeof box_m === "number"
      ? new AsciiMap(ascii, box_m)
      : null;
  }

  has([column, row]: Cell): boolean {
    return column >= 0 && row >= 0 && column < this.width && row < this.height;
  }

  /** The character of a box; a blank counts as free. */
  charAt([column, row]: Cell): MapChar | undefined {
    const char = this.#lines[this.height - 1 - row]?.[column];
    return char === " " ? "." : (char as MapChar | undefined);
  }

  /** The edit that draws boxes; null where nothing would change. */
  paint(cells: readonly Cell[], char: MapChar): Edit | null {
    const changed = cells.filter((cell) => this.has(cell) && this.charAt(cell) !== char);
    if (changed.length === 0) return null;
    const chars = changed.map(([column, row]): [number, number, string] => [
      this.#skipped + this.height - 1 - row,
      column,
      char,
    ]);
    return { op: "paint", key: keyOf(["map", "ascii"]), cells: chars };
  }
}

/** The placement of a grid of boxes in the world. */
export interface GridPlacement {
  box_m: number;
  width: number;
  height: number;
  origin_m: readonly [number, number];
  yaw_rad: number;
}

/** The placement of the grid that tools edit: the drawn map, else the scene's floor. */
export function placementOf(map: AsciiMap | null, floor: OccupancyGrid | null): GridPlacement | null {
  if (map) return { box_m: map.box_m, width: map.width, height: map.height, origin_m: [0, 0], yaw_rad: 0 };
  return floor;
}

/** The position of a corner of boxes, in meters. */
export function cornerPosition({ box_m, origin_m, yaw_rad }: GridPlacement, column: number, row: number): Point3 {
  const [x, y] = [column * box_m, row * box_m];
  const [c, s] = [Math.cos(yaw_rad), Math.sin(yaw_rad)];
  return [origin_m[0] + c * x - s * y, origin_m[1] + s * x + c * y, 0];
}

/** The box at a position. */
export function cellOf({ box_m, origin_m, yaw_rad }: GridPlacement, x_m: number, y_m: number): Cell {
  const [x, y] = [x_m - origin_m[0], y_m - origin_m[1]];
  const [c, s] = [Math.cos(yaw_rad), Math.sin(yaw_rad)];
  return [Math.floor((c * x + s * y) / box_m), Math.floor((c * y - s * x) / box_m)];
}

/** A floor as the text of a drawn map. */
export function asciiOf(floor: Pick<OccupancyGrid, "width" | "height">, boxes: Uint8Array): string {
  const letters = [".", "#", "?"];
  const lines: string[] = [];
  for (let row = floor.height - 1; row >= 0; row--) {
    let line = "";
    for (let column = 0; column < floor.width; column++) line += letters[boxes[row * floor.width + column]!] ?? "?";
    lines.push(line);
  }
  return `${lines.join("\n")}\n`;
}

/** What people choose of a new drawing. */
export interface DrawingChoice {
  name: string;
  columns: number;
  rows: number;
  box_m: number;
}

/** The text of a new scenario with an empty map within walls; `template` is what its world declares. */
export function drawnScenario(template: string, { name, columns, rows, box_m }: DrawingChoice): string {
  const wall = "#".repeat(columns);
  const free = `#${".".repeat(columns - 2)}#`;
  const values: Record<string, string> = {
    name: JSON.stringify(name),
    box_size_m: String(box_m),
    map: [wall, ...Array.from({ length: rows - 2 }, () => free), wall].join("\n"),
    column: String(Math.floor(columns / 2) - 1),
    row: String(Math.floor(rows / 2) - 1),
  };
  // Only known words: braces are part of TOML, too.
  return template.replace(/\{(\w+)\}/g, (whole, key: string) => values[key] ?? whole);
}
