/**
 * The drawn map of a scenario of robots: `map.ascii`. Its first line is the north edge; boxes count columns from the west
 * and rows from the south, as all places of the scenario do, and box (0, 0) begins at the origin.
 */

import type { Floor, Place } from "../protocol";
import type { Cell } from "./cells";
import { keyOf, valueAt, type Table } from "./keypath";
import type { Edit } from "../protocol";

export type Mark = "#" | "." | "?";

/** Side of a box where the scenario does not say it. */
const BOX_M = 0.25;
/** A floor of more boxes is too much for a text that people read. */
export const MOST_BOXES = 250_000;

export class Board {
  readonly width: number;
  readonly height: number;
  readonly box_m: number;
  readonly #lines: string[];
  /** Lines of the text before the first of the map. */
  readonly #skipped: number;

  constructor(art: string, box_m: number) {
    this.#skipped = /^\r?\n/.test(art) ? 1 : 0;
    this.#lines = art
      .replace(/^\r?\n/, "")
      .replace(/[\r\n]+$/, "")
      .split(/\r?\n/);
    this.width = this.#lines[0]!.length;
    this.height = this.#lines.length;
    this.box_m = box_m;
  }

  /** The drawn map of a scenario, if it has one. */
  static of(model: Table | null): Board | null {
    const art = valueAt(model ?? {}, ["map", "ascii"]);
    const box_m = valueAt(model ?? {}, ["map", "box_size_m"]) ?? BOX_M;
    return typeof art === "string" && art.trim() !== "" && typeof box_m === "number" ? new Board(art, box_m) : null;
  }

  has([column, row]: Cell): boolean {
    return column >= 0 && row >= 0 && column < this.width && row < this.height;
  }

  /** The mark of a box; a blank counts as free. */
  markAt([column, row]: Cell): Mark | undefined {
    const mark = this.#lines[this.height - 1 - row]?.[column];
    return mark === " " ? "." : (mark as Mark | undefined);
  }

  /** The edit that draws boxes; null where nothing would change. */
  paint(cells: readonly Cell[], mark: Mark): Edit | null {
    const changed = cells.filter((cell) => this.has(cell) && this.markAt(cell) !== mark);
    if (changed.length === 0) return null;
    const marks = changed.map(([column, row]): [number, number, string] => [
      this.#skipped + this.height - 1 - row,
      column,
      mark,
    ]);
    return { op: "paint", key: keyOf(["map", "ascii"]), cells: marks };
  }
}

/** The placement of a scenario's boxes in the world. */
export interface Ground {
  box_m: number;
  width: number;
  height: number;
  origin_m: readonly [number, number];
  yaw_rad: number;
}

/** The ground that tools work on: the drawn map, else the floor that the program made. */
export function groundOf(board: Board | null, floor: Floor | null): Ground | null {
  if (board) return { box_m: board.box_m, width: board.width, height: board.height, origin_m: [0, 0], yaw_rad: 0 };
  return floor;
}

/** The place of a corner of boxes, in meters. */
export function placeOf({ box_m, origin_m, yaw_rad }: Ground, column: number, row: number): Place {
  const [x, y] = [column * box_m, row * box_m];
  const [c, s] = [Math.cos(yaw_rad), Math.sin(yaw_rad)];
  return [origin_m[0] + c * x - s * y, origin_m[1] + s * x + c * y, 0];
}

/** The box that holds a place. */
export function cellOf({ box_m, origin_m, yaw_rad }: Ground, x_m: number, y_m: number): Cell {
  const [x, y] = [x_m - origin_m[0], y_m - origin_m[1]];
  const [c, s] = [Math.cos(yaw_rad), Math.sin(yaw_rad)];
  return [Math.floor((c * x + s * y) / box_m), Math.floor((c * y - s * x) / box_m)];
}

/** A floor as the text of a drawn map. */
export function artOf(floor: Pick<Floor, "width" | "height">, boxes: Uint8Array): string {
  const letters = [".", "#", "?"];
  const lines: string[] = [];
  for (let row = floor.height - 1; row >= 0; row--) {
    let line = "";
    for (let column = 0; column < floor.width; column++) line += letters[boxes[row * floor.width + column]!] ?? "?";
    lines.push(line);
  }
  return `${lines.join("\n")}\n`;
}

/** The text of an empty board within walls, with one robot in the middle to begin with. */
export function blank(name: string, width: number, height: number, box_m: number): string {
  const wall = "#".repeat(width);
  const free = `#${".".repeat(width - 2)}#`;
  const rows = [wall, ...Array.from({ length: height - 2 }, () => free), wall].join("\n");
  const [column, row] = [Math.floor(width / 2) - 1, Math.floor(height / 2) - 1];
  return `# Drawn in the studio. Places are [column, row] in boxes from the lower-left corner.

format = 1
world = "robots"
name = ${JSON.stringify(name)}
seed = 1

# Wall #, free . and unknown ?; the first line is the north edge.
[map]
box_size_m = ${box_m}
ascii = """
${rows}
"""

[[robots]]
size = 2
at = [[${column}, ${row}]]
sensors = ["sonar-ring"]
effector = "nomad"
behaviour = { kind = "wander" }
`;
}
