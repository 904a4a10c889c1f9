/** The active tool on the canvas of a draft, and its edits of the text. */

import type { Edit, Point3 } from "../protocol";
import { boxesOf } from "../scene/floor";
import type { Session } from "../state/session.svelte";
import {
  asciiOf,
  AsciiMap,
  cellOf,
  placementOf,
  MAX_BOXES,
  cornerPosition,
  type GridPlacement,
  type MapChar,
} from "./ascii-map";
import { brushCells, floodCells, lineCells, rectangleCells, rectOf, type Cell } from "./cells";
import type { Draft } from "./draft.svelte";
import { valueAt, type Path } from "./keypath";
import { restrictionOn, toolsOf, type EditAction, type ItemSource, type Tool } from "./editing";
import { bodyItems, goalItems, lowerLeftAround, putBody, putDoor, putGoal, sideOfNewBody } from "./tools/boxes";
import { insert, remove, set, type Item } from "./tools/item";
import { obstacleItems, putBall, putBox, putPatrol, putPolygon, putWall, startItems } from "./tools/obstacles";
import { pointItems, putPoint } from "./tools/points";
import { putRoute, putWayPoint, routeItems } from "./tools/routes";

/** A press in progress: its start, its current position, and the boxes between. */
export interface Stroke {
  from: Point3;
  to: Point3;
  /** Boxes touched by a brush. */
  trail: Cell[];
  /** Whether Shift is held: rectangles are filled. */
  isFilled: boolean;
}

export class CanvasEditor {
  readonly draft: Draft;
  readonly session: Session;
  /** The id of the active tool. */
  tool = $state("select");
  char = $state<MapChar>("#");
  /** Side of the brush in boxes. */
  side = $state(1);
  /** Meters per pixel: the precision of written positions. */
  m_per_px = $state(0.01);

  constructor(draft: Draft) {
    this.draft = draft;
    this.session = draft.session;
  }

  readonly #ownTools = $derived.by(() => toolsOf(this.draft.editing, this.session.run.scene));
  /** Returns whether tools draw the boxes of a map in this world. */
  readonly #paintsMap = $derived.by(() => this.#ownTools.some(({ action }) => action.do === "paint"));
  readonly map = $derived.by(() => (this.#paintsMap ? AsciiMap.fromModel(this.draft.model) : null));
  readonly ground = $derived.by((): GridPlacement | null => placementOf(this.map, this.session.run.scene.floor));
  readonly items = $derived.by((): Item[] => this.draft.editing.items.flatMap((source) => this.#itemsOf(source)));
  readonly selected = $derived.by(() => this.items.find(({ path }) => isSame(path, this.draft.selected)) ?? null);
  readonly tools = $derived.by((): Tool[] =>
    this.#ownTools.filter(({ action }) => this.map !== null || action.do !== "paint"),
  );
  /** The effect of the active tool. */
  readonly action = $derived.by(
    (): EditAction => this.tools.find(({ id }) => id === this.tool)?.action ?? { do: "select" },
  );
  readonly restriction = $derived.by(() => {
    const { model, world, editing } = this.draft;
    // Without the world's answer nobody knows yet what can be edited.
    if (world === null && !this.session.run.scene.is_recording) return "";
    return restrictionOn(editing, this.session.run.scene, model ?? {});
  });
  /** Returns whether the shown map can become a drawn one. */
  readonly canInlineMap = $derived.by(() => {
    const { floor } = this.session.run.scene;
    return (
      this.#paintsMap &&
      this.map === null &&
      this.draft.model !== null &&
      floor !== null &&
      floor.width * floor.height <= MAX_BOXES
    );
  });

  #itemsOf(source: ItemSource): Item[] {
    const { model } = this.draft;
    if (!model) return [];
    const { m_per_px, ground } = this;
    const dimensions = this.session.run.scene.dimensions === 3 ? 3 : 2;
    const format = { dimensions, m_per_px } as const;
    if (source.of === "obstacles") return obstacleItems(model, source.section, format);
    if (source.of === "starts") return startItems(model, source.section, source.noun, format);
    // All others have two coordinates.
    if (dimensions === 3) return [];
    switch (source.of) {
      case "points":
        return pointItems(model, source.section, source.noun, m_per_px);
      case "routes":
        return routeItems(model, source.section, source.noun, m_per_px);
      case "bodies":
        return ground ? bodyItems(model, source, ground) : [];
      case "goals":
        return ground ? goalItems(model, source.section, ground) : [];
    }
  }

  /** The boxes between two positions. */
  cellsBetween(from: Point3, to: Point3): Cell[] {
    const { ground } = this;
    return ground ? lineCells(cellOf(ground, from[0], from[1]), cellOf(ground, to[0], to[1])) : [];
  }

  /** The boxes that the stroke would draw. */
  cells(stroke: Stroke): Cell[] {
    const { map, ground } = this;
    if (!map || !ground) return [];
    const [from, to] = [stroke.from, stroke.to].map(([x, y]) => cellOf(ground, x, y)) as [Cell, Cell];
    if (this.action.do === "add-door") return rectangleCells(from, to, true);
    if (this.action.do !== "paint") return [];
    switch (this.action.area) {
      case "brush":
      case "eraser":
        return brushCells([...stroke.trail, to], this.side);
      case "line":
        return brushCells(lineCells(from, to), this.side);
      case "rectangle":
        return rectangleCells(from, to, stroke.isFilled);
      case "fill":
        return floodCells(to, map.width, map.height, (cell) => map.charAt(cell));
    }
  }

  /** The boxes of a body that would be placed there. */
  bodyCells(to: Point3): Cell[] {
    const { ground, action } = this;
    const { model } = this.draft;
    if (!ground || !model || (action.do !== "add-body" && action.do !== "add-goal")) return [];
    const cell = cellOf(ground, to[0], to[1]);
    if (action.do === "add-goal") return [cell];
    const side = sideOfNewBody(model, action.section, this.draft.selected);
    const [column, row] = lowerLeftAround(cell, side);
    return rectangleCells([column, row], [column + side - 1, row + side - 1], true);
  }

  /** Applies the tool to a finished stroke. */
  apply(stroke: Stroke): Promise<boolean> {
    return this.draft.edit(() => this.#edits(stroke));
  }

  #edits(stroke: Stroke): Edit[] {
    const { model, selected: chosen } = this.draft;
    const { from, to } = stroke;
    const { action, m_per_px } = this;
    if (!model) return [];
    switch (action.do) {
      case "add-ball":
        return putBall(
          action.section,
          from,
          Math.max(Math.hypot(to[0] - from[0], to[1] - from[1]), 8 * m_per_px),
          m_per_px,
        );
      case "add-wall":
        return putWall(action.section, from, to, m_per_px);
      case "add-box":
        return putBox(action.section, from, to, m_per_px);
      case "add-polygon":
        return putPolygon({ model, section: action.section, chosen, m_per_px }, from, to);
      case "add-patrol":
        return putPatrol({ model, section: action.section, chosen, m_per_px }, to);
      case "add-point":
        return putPoint(action.section, to, m_per_px);
      case "add-route":
        return putRoute(action.section, from, this.#routeEnd(from, to), m_per_px);
      case "add-way-point":
        return putWayPoint({ model, section: action.section, chosen, m_per_px }, to);
      default:
        return this.ground ? this.#boxEdits(stroke, this.ground) : [];
    }
  }

  #boxEdits(stroke: Stroke, ground: GridPlacement): Edit[] {
    const model = this.draft.model ?? {};
    const { selected: chosen } = this.draft;
    const { action } = this;
    const cell = cellOf(ground, stroke.to[0], stroke.to[1]);
    if (action.do === "add-body") {
      const side = sideOfNewBody(model, action.section, chosen);
      return putBody(model, action, lowerLeftAround(cell, side), chosen);
    }
    if (action.do === "add-goal") return putGoal(model, action.section, cell, chosen);
    if (action.do === "add-door")
      return putDoor(model, action, this.map, rectOf(cellOf(ground, stroke.from[0], stroke.from[1]), cell));
    if (action.do !== "paint") return [];
    const painted = this.map?.paint(this.cells(stroke), action.area === "eraser" ? "." : this.char);
    return painted ? [painted] : [];
  }

  /** The end of a route; after a click without a drag, 300 pixels to the east. */
  #routeEnd(from: Point3, to: Point3): Point3 {
    const isShort = Math.hypot(to[0] - from[0], to[1] - from[1]) < 8 * this.m_per_px;
    return isShort ? [from[0] + 300 * this.m_per_px, from[1], 0] : to;
  }

  choose(item: Item | null): void {
    this.draft.selected = item?.path ?? null;
    // The item selected here is also open in the forms.
    if (item) this.draft.open = item.path;
  }

  /** Returns the item as earlier edits have left it. */
  #current(item: Item): Item | undefined {
    return this.items.find(({ path }) => isSame(path, item.path));
  }

  moveTo(item: Item, to: Point3): Promise<boolean> {
    return this.draft.edit(() => this.#current(item)?.move(to) ?? []);
  }

  async removeSelected(): Promise<void> {
    const item = this.selected;
    if (!item) return;
    this.choose(null);
    await this.draft.edit(() => this.#current(item)?.remove() ?? []);
  }

  async rotateSelected(): Promise<void> {
    const item = this.selected;
    if (item?.turn) await this.draft.edit(() => this.#current(item)?.turn?.() ?? []);
  }

  /** Writes the shown map into the text, with the doors of a generated office, so that it can be edited. */
  inlineMap(): Promise<boolean> {
    const { floor } = this.session.run.scene;
    const model = this.draft.model;
    if (!floor || !model || !this.canInlineMap) return Promise.resolve(false);
    const removed = ["office", "file", "resolution_m"].filter((key) => valueAt(model, ["map", key]) !== undefined);
    const edits: Edit[] = removed.map((key) => remove(["map", key]));
    edits.push(set(["map", "box_size_m"], floor.box_m), set(["map", "ascii"], asciiOf(floor, boxesOf(floor))));
    return this.draft.edit([...edits, ...this.#officeDoors()]);
  }

  /** The doors of an office with explicit positions: a section for each size, with their schedule. */
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
    const hasPositions = Array.isArray(table["at"]);
    const [first, ...others] = [...bySize.values()];
    const edits: Edit[] = [remove([...host.path, "office"])];
    if (!hasPositions && first)
      edits.push(set([...host.path, "at"], first.at), set([...host.path, "size"], first.size));
    if (!hasPositions && !first) return [remove(host.path)];
    for (const one of hasPositions && first ? [first, ...others] : others)
      edits.push(insert(["doors"], { ...schedule, at: one.at, size: one.size }));
    return edits;
  }

  #doorsBySize(): Map<string, { at: number[][]; size: [number, number] }> {
    const { bodies, newest: frame } = this.session.frames;
    const { scene } = this.session.run;
    const bySize = new Map<string, { at: number[][]; size: [number, number] }>();
    const floor = scene.floor;
    if (!bodies || !frame || !floor) return bySize;
    for (let i = 0; i < bodies.count; i++) {
      const shape = bodies.table.shapes[bodies.table.shape[i]!]!;
      if (bodies.bodyId(i).kind !== "door" || shape.type !== "cuboid") continue;
      const size: [number, number] = [
        Math.round(shape.size_m[0] / floor.box_m),
        Math.round(shape.size_m[1] / floor.box_m),
      ];
      const [x, y] = [
        frame.positions_m[2 * i]! - shape.size_m[0] / 2,
        frame.positions_m[2 * i + 1]! - shape.size_m[1] / 2,
      ];
      const cell = cellOf(floor, x + floor.box_m / 2, y + floor.box_m / 2);
      const group = bySize.get(size.join()) ?? { at: [], size };
      group.at.push([...cell]);
      bySize.set(size.join(), group);
    }
    return bySize;
  }

  /** Describes a position as text. */
  describePosition(to: Point3): string {
    const { ground, map } = this;
    const meters = (axis: string, value: number): string => `${axis} ${value.toPrecision(4)} m`;
    const height = this.session.run.scene.dimensions === 3 ? `, ${meters("z", to[2])}` : "";
    if (!ground) return `${meters("x", to[0])}, ${meters("y", to[1])}${height}`;
    const cell = cellOf(ground, to[0], to[1]);
    const char = map?.charAt(cell);
    const state = char === "#" ? ", wall" : char === "?" ? ", unknown" : char === "." ? ", free" : "";
    return `column ${cell[0]}, row ${cell[1]}${state}`;
  }

  /** The center of the box at a position; the position itself where there are no boxes. */
  snap(to: Point3): Point3 {
    const { ground } = this;
    if (!ground) return to;
    const [column, row] = cellOf(ground, to[0], to[1]);
    return cornerPosition(ground, column + 0.5, row + 0.5);
  }
}

function isSame(a: Path, b: Path | null): boolean {
  return b !== null && a.length === b.length && a.every((part, i) => String(part) === String(b[i]));
}

const editors = new WeakMap<Draft, CanvasEditor>();

/** The canvas editor of a draft. */
export function canvasEditorOf(draft: Draft): CanvasEditor {
  const known = editors.get(draft);
  if (known) return known;
  let created!: CanvasEditor;
  // Its derived values must outlive the component that creates it.
  $effect.root(() => void (created = new CanvasEditor(draft)));
  editors.set(draft, created);
  return created;
}
