/** The tool in hand over the canvas of a draft, and its edits of the text. */

import type { Edit, Place } from "../protocol";
import { boxesOf } from "../scene/floor";
import type { Session } from "../state/session.svelte";
import { artOf, Board, cellOf, groundOf, MOST_BOXES, placeOf, type Ground, type Mark } from "./board";
import { brushed, floodCells, lineCells, rectangleCells, rectOf, type Cell } from "./cells";
import type { Draft } from "./draft.svelte";
import { valueAt, type Path } from "./keypath";
import { airplaneItems, putAirplane, putWayPoint } from "./tools/airspace";
import { chainItems, putBall, putBox, putPatrol, putPolygon, putWall } from "./tools/chain";
import { insert, remove, set, type Item } from "./tools/item";
import { around, putBody, putDoor, putGoal, robotItems, robotSide } from "./tools/robots";
import { obstacleTo, toolsOf, type Tool, type ToolId } from "./tools/tools";

/** A press that has not been released: where it began, where it is, and the boxes between. */
export interface Stroke {
  from: Place;
  to: Place;
  /** Boxes that a brush has touched. */
  trail: Cell[];
  /** Whether Shift is held. */
  isWhole: boolean;
}

export class Bench {
  readonly draft: Draft;
  readonly session: Session;
  tool = $state<ToolId>("select");
  mark = $state<Mark>("#");
  /** Side of the brush in boxes. */
  side = $state(1);
  /** Meters of a pixel: how finely places are written. */
  m_per_px = $state(0.01);

  constructor(draft: Draft) {
    this.draft = draft;
    this.session = draft.session;
  }

  readonly board = $derived.by(() => (this.session.scene.world === "robots" ? Board.of(this.draft.model) : null));
  readonly ground = $derived.by((): Ground | null => groundOf(this.board, this.session.scene.floor));
  readonly items = $derived.by((): Item[] => this.#items());
  readonly chosen = $derived.by(() => this.items.find(({ path }) => isSame(path, this.draft.chosen)) ?? null);
  readonly tools = $derived.by((): Tool[] =>
    toolsOf(this.session.scene).filter((tool) => this.board !== null || !tool.paints),
  );
  readonly obstacle = $derived.by(() => {
    const model = this.draft.model ?? {};
    const has = (path: Path): boolean => valueAt(model, path) !== undefined;
    return obstacleTo(this.session.scene, this.board, {
      file: has(["map", "file"]),
      office: has(["map", "office"]),
      airplanes: has(["airplanes"]),
    });
  });
  /** Returns whether the map of the picture can become a drawn one. */
  readonly canTakeMap = $derived.by(() => {
    const { world, floor } = this.session.scene;
    return (
      world === "robots" &&
      this.board === null &&
      this.draft.model !== null &&
      floor !== null &&
      floor.width * floor.height <= MOST_BOXES
    );
  });

  #items(): Item[] {
    const { model } = this.draft;
    const { world, dimensions } = this.session.scene;
    if (!model) return [];
    if (world === "chain") return chainItems(model, this.m_per_px, dimensions === 3 ? 3 : 2);
    if (dimensions !== 2) return [];
    if (world === "robots") return this.ground ? robotItems(model, this.ground) : [];
    return world === "airspace" ? airplaneItems(model, this.m_per_px) : [];
  }

  /** The boxes between two places. */
  between(from: Place, to: Place): Cell[] {
    const { ground } = this;
    return ground ? lineCells(cellOf(ground, from[0], from[1]), cellOf(ground, to[0], to[1])) : [];
  }

  /** The boxes that a stroke would draw now. */
  cells(stroke: Stroke): Cell[] {
    const { board, ground } = this;
    if (!board || !ground) return [];
    const [from, to] = [stroke.from, stroke.to].map(([x, y]) => cellOf(ground, x, y)) as [Cell, Cell];
    switch (this.tool) {
      case "brush":
      case "eraser":
        return brushed([...stroke.trail, to], this.side);
      case "line":
        return brushed(lineCells(from, to), this.side);
      case "rectangle":
        return rectangleCells(from, to, stroke.isWhole);
      case "fill":
        return floodCells(to, board.width, board.height, (cell) => board.markAt(cell));
      case "door":
        return rectangleCells(from, to, true);
      default:
        return [];
    }
  }

  /** The box of a body that would be put there. */
  bodyAt(to: Place): Cell[] {
    const { ground } = this;
    const { model } = this.draft;
    if (!ground || !model || (this.tool !== "robot" && this.tool !== "person" && this.tool !== "goal")) return [];
    const cell = cellOf(ground, to[0], to[1]);
    if (this.tool === "goal") return [cell];
    const side = robotSide(model, this.tool === "robot" ? "robots" : "people", this.draft.chosen);
    const [column, row] = around(cell, side);
    return rectangleCells([column, row], [column + side - 1, row + side - 1], true);
  }

  /** Applies the tool to a finished stroke. */
  apply(stroke: Stroke): Promise<boolean> {
    return this.draft.edit(() => this.#edits(stroke));
  }

  #edits(stroke: Stroke): Edit[] {
    const { model, chosen } = this.draft;
    const { from, to } = stroke;
    if (!model) return [];
    switch (this.tool) {
      case "ball":
        return putBall(from, Math.max(Math.hypot(to[0] - from[0], to[1] - from[1]), 8 * this.m_per_px), this.m_per_px);
      case "wall":
        return putWall(from, to, this.m_per_px);
      case "box":
        return putBox(from, to, this.m_per_px);
      case "polygon":
        return putPolygon(model, from, to, chosen, this.m_per_px);
      case "patrol":
        return putPatrol(model, to, chosen, this.m_per_px);
      case "airplane":
        return putAirplane(from, this.#far(from, to), this.m_per_px);
      case "way-point":
        return putWayPoint(model, to, chosen, this.m_per_px);
      default:
        return this.ground ? this.#boxEdits(stroke, this.ground) : [];
    }
  }

  #boxEdits(stroke: Stroke, ground: Ground): Edit[] {
    const model = this.draft.model ?? {};
    const { chosen } = this.draft;
    const cell = cellOf(ground, stroke.to[0], stroke.to[1]);
    if (this.tool === "robot" || this.tool === "person") {
      const key = this.tool === "robot" ? "robots" : "people";
      return putBody(model, key, around(cell, robotSide(model, key, chosen)), chosen);
    }
    if (this.tool === "goal") return putGoal(model, cell, chosen);
    if (this.tool === "door")
      return putDoor(model, this.board, rectOf(cellOf(ground, stroke.from[0], stroke.from[1]), cell));
    const painted = this.board?.paint(this.cells(stroke), this.tool === "eraser" ? "." : this.mark);
    return painted ? [painted] : [];
  }

  /** A way that is too short to be meant goes east over a third of the picture. */
  #far(from: Place, to: Place): Place {
    const isShort = Math.hypot(to[0] - from[0], to[1] - from[1]) < 8 * this.m_per_px;
    return isShort ? [from[0] + 300 * this.m_per_px, from[1], 0] : to;
  }

  choose(item: Item | null): void {
    this.draft.chosen = item?.path ?? null;
    // The item chosen here is open in the forms.
    if (item) this.draft.open = item.path;
  }

  /** Returns the item as the changes before have left it. */
  #now(item: Item): Item | undefined {
    return this.items.find(({ path }) => isSame(path, item.path));
  }

  moveTo(item: Item, to: Place): Promise<boolean> {
    return this.draft.edit(() => this.#now(item)?.move(to) ?? []);
  }

  async removeChosen(): Promise<void> {
    const item = this.chosen;
    if (!item) return;
    this.choose(null);
    await this.draft.edit(() => this.#now(item)?.remove() ?? []);
  }

  async turnChosen(): Promise<void> {
    const item = this.chosen;
    if (item?.turn) await this.draft.edit(() => this.#now(item)?.turn?.() ?? []);
  }

  /** Writes the map of the picture into the text, with the doors of a generated office, so that it can be drawn upon. */
  takeMap(): Promise<boolean> {
    const { floor } = this.session.scene;
    const model = this.draft.model;
    if (!floor || !model || !this.canTakeMap) return Promise.resolve(false);
    const gone = ["office", "file", "resolution_m"].filter((key) => valueAt(model, ["map", key]) !== undefined);
    const edits: Edit[] = gone.map((key) => remove(["map", key]));
    edits.push(set(["map", "box_size_m"], floor.box_m), set(["map", "ascii"], artOf(floor, boxesOf(floor))));
    return this.draft.edit([...edits, ...this.#officeDoors()]);
  }

  /** The doors of an office, each with its place: sections for each size, with the schedule that they had. */
  #officeDoors(): Edit[] {
    const doors = valueAt(this.draft.model ?? {}, ["doors"]);
    const sections = Array.isArray(doors)
      ? doors.map((value, i) => ({ path: ["doors", i], value }))
      : [{ path: ["doors"], value: doors }];
    const host = sections.find(({ value }) => valueAt(value, ["office"]) === true);
    const table = host?.value as Record<string, unknown> | undefined;
    if (!host || !table) return [];
    const { office: _, at: __, size: ___, ...schedule } = table;
    const bySize = this.#doorsBySize();
    const keepsOwn = Array.isArray(table["at"]);
    const [first, ...others] = [...bySize.values()];
    const edits: Edit[] = [remove([...host.path, "office"])];
    if (!keepsOwn && first) edits.push(set([...host.path, "at"], first.at), set([...host.path, "size"], first.size));
    if (!keepsOwn && !first) return [remove(host.path)];
    for (const one of keepsOwn && first ? [first, ...others] : others)
      edits.push(insert(["doors"], { ...schedule, at: one.at, size: one.size }));
    return edits;
  }

  #doorsBySize(): Map<string, { at: number[][]; size: [number, number] }> {
    const { bodies, frame, scene } = this.session;
    const bySize = new Map<string, { at: number[][]; size: [number, number] }>();
    const floor = scene.floor;
    if (!bodies || !frame || !floor) return bySize;
    for (let i = 0; i < bodies.count; i++) {
      const shape = bodies.cast.shapes[bodies.cast.shape[i]!]!;
      if (bodies.who(i).kind !== "door" || shape.type !== "cuboid") continue;
      const size: [number, number] = [
        Math.round(shape.size_m[0] / floor.box_m),
        Math.round(shape.size_m[1] / floor.box_m),
      ];
      const [x, y] = [frame.places_m[2 * i]! - shape.size_m[0] / 2, frame.places_m[2 * i + 1]! - shape.size_m[1] / 2];
      const cell = cellOf(floor, x + floor.box_m / 2, y + floor.box_m / 2);
      const group = bySize.get(size.join()) ?? { at: [], size };
      group.at.push([...cell]);
      bySize.set(size.join(), group);
    }
    return bySize;
  }

  /** Describes a place in words. */
  wordsAt(to: Place): string {
    const { ground, board } = this;
    const meters = (axis: string, value: number): string => `${axis} ${value.toPrecision(4)} m`;
    const height = this.session.scene.dimensions === 3 ? `, ${meters("z", to[2])}` : "";
    if (!ground) return `${meters("x", to[0])}, ${meters("y", to[1])}${height}`;
    const cell = cellOf(ground, to[0], to[1]);
    const mark = board?.markAt(cell);
    const what = mark === "#" ? ", wall" : mark === "?" ? ", unknown" : mark === "." ? ", free" : "";
    return `column ${cell[0]}, row ${cell[1]}${what}`;
  }

  /** The middle of the box that holds a place; the place itself where there are no boxes. */
  snapped(to: Place): Place {
    const { ground } = this;
    if (!ground) return to;
    const [column, row] = cellOf(ground, to[0], to[1]);
    return placeOf(ground, column + 0.5, row + 0.5);
  }
}

function isSame(a: Path, b: Path | null): boolean {
  return b !== null && a.length === b.length && a.every((part, i) => String(part) === String(b[i]));
}

const benches = new WeakMap<Draft, Bench>();

/** The bench of a draft. */
export function benchOf(draft: Draft): Bench {
  const known = benches.get(draft);
  if (known) return known;
  let made!: Bench;
  // Its derived values must outlive the component that asks first.
  $effect.root(() => void (made = new Bench(draft)));
  benches.set(draft, made);
  return made;
}
