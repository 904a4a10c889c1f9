/** Draws traffic in plan view: from above, north up, with symbols that keep their size. */

import { Group, type Mesh, type RawShaderMaterial } from "three";
import type { Frame } from "../decode";
import type { BodyId, Scene } from "../protocol";
import type { Bodies } from "../state/bodies";
import { flatRadiusOf } from "./extent";
import { DART, DISC, Glyphs } from "./glyphs";
import { css, packColor, tintsOf, visibleColor, type Palette } from "./palette";
import { lookahead_s } from "./plan-units";
import { Strokes } from "./strokes";
import { areaColor, fillArea, movingAreas, staticAreas, type DrawnArea } from "./traffic-areas";
import type { Painter, ViewScale } from "./viewport";

/** Half the length of a symbol. */
export const SYMBOL_PX = 6.5;
/** Conditions that should not occur: too near to another, or failed. */
const ALERTS: readonly number[] = [3, 4];
/** Number of routes that are drawn without a selection: with more, no single one can be followed. */
const MAX_ROUTES = 12;

/** An aircraft of the shown frame. */
export interface Aircraft {
  index: number;
  x_m: number;
  y_m: number;
  altitude_m: number;
  /** East, north and up; null where the frames have no velocities. */
  velocity_m_s: readonly [number, number, number] | null;
  isAlert: boolean;
}

/** Whether a scene is shown in plan view. */
export function isPlan(scene: Scene, projection: "plan" | "space"): boolean {
  return scene.traffic !== null && (scene.dimensions === 2 || projection === "plan");
}

export class PlanPainter implements Painter {
  readonly group = new Group();
  readonly #fills = new Group();
  readonly #borders = new Strokes(2);
  readonly #routes = new Strokes(2);
  readonly #zones = new Glyphs(3);
  readonly #vectors = new Strokes(5);
  readonly #symbols = new Glyphs(6);
  readonly #scene: Scene;
  readonly #static: DrawnArea[];
  #moving: DrawnArea[] = [];
  #palette: Palette | null = null;
  #bodies: Bodies | null = null;
  #frame: Frame | null = null;
  #tints: Uint32Array = new Uint32Array(0);
  /** The colors of bodies that do not have their usual ones. */
  #ownTints: Uint32Array | null = null;
  #hidesAgents = false;
  /** Whether colors tell the state of each body. */
  #tellsStates = false;
  #look = 0;
  /** The zone of each agent, by the indices of bodies. */
  #zoneOf = new Map<number, number>();
  #selected: number | undefined;
  #hovered: number | undefined;
  #extent_m = 1;
  /** Pixels of the canvas for each of the page, which all hatches share. */
  readonly #ratio = { value: 1 };

  constructor(scene: Scene) {
    this.#scene = scene;
    this.#static = staticAreas(scene);
    this.group.add(this.#fills);
    for (const { quads } of [this.#borders, this.#routes, this.#zones, this.#vectors, this.#symbols])
      this.group.add(quads.mesh);
  }

  get areas(): readonly DrawnArea[] {
    return [...this.#static, ...this.#moving];
  }

  get bodies(): Bodies | null {
    return this.#bodies;
  }

  /** The time that velocity vectors reach ahead. */
  get lookahead_s(): number {
    let fastest_m_s = 0;
    for (const { velocity_m_s } of this.aircraft())
      if (velocity_m_s) fastest_m_s = Math.max(fastest_m_s, Math.hypot(velocity_m_s[0], velocity_m_s[1]));
    return lookahead_s(fastest_m_s, this.#extent_m);
  }

  /** Counts changes of bodies and of their colors. */
  get look(): number {
    return this.#look;
  }

  get hidesAgents(): boolean {
    return this.#hidesAgents;
  }

  setColors(tints: Uint32Array | null, hidesAgents: boolean, tellsStates = false): void {
    const isSame = tints === this.#ownTints && hidesAgents === this.#hidesAgents && tellsStates === this.#tellsStates;
    if (isSame) return;
    this.#look++;
    this.#ownTints = tints;
    this.#hidesAgents = hidesAgents;
    this.#tellsStates = tellsStates;
  }

  paint(palette: Palette): void {
    this.#palette = palette;
    this.#fillAreas();
    this.#colors();
    if (this.#frame) this.#drawMoving();
  }

  setBodies(bodies: Bodies): void {
    this.#look++;
    this.#bodies = bodies;
    this.#frame = null;
    this.#zoneOf = zonesOf(bodies);
    this.#colors();
  }

  /** Zones and routes are drawn of the selected aircraft, and of the one under the pointer. */
  setFocus(selected: BodyId | null, hovered: number | undefined): void {
    this.#selected = selected ? this.#bodies?.find(selected) : undefined;
    this.#hovered = hovered;
    if (this.#frame) this.#drawMoving();
  }

  frame(frame: Frame): void {
    this.#frame = frame;
    const hadMoving = this.#moving.length > 0;
    this.#moving = this.#bodies ? movingAreas(this.#scene, this.#bodies, frame) : [];
    if (hadMoving || this.#moving.length > 0) this.#fillAreas();
    this.#drawMoving();
  }

  scale({ pxPerM, palette, width_px, height_px, ratio }: ViewScale): void {
    this.#ratio.value = ratio;
    for (const glyphs of [this.#zones, this.#symbols]) glyphs.scale(pxPerM, palette);
    for (const strokes of [this.#borders, this.#routes, this.#vectors]) strokes.scale(pxPerM, width_px, height_px);
    this.#extent_m = Math.max(width_px, height_px) / pxPerM;
    if (this.#frame) this.#drawVectors();
  }

  dispose(): void {
    this.#dropFills();
    for (const { quads } of [this.#borders, this.#routes, this.#zones, this.#vectors, this.#symbols]) quads.dispose();
  }

  /** The color of the words of an aircraft. */
  inkOf({ index, isAlert }: Aircraft, palette: Palette): string {
    if (!isAlert) return css(palette.ink);
    return this.#tellsStates ? cssOfTint(this.tintOf(index)) : css(alertInk(palette));
  }

  /** The aircraft of the shown frame. */
  aircraft(): Aircraft[] {
    const [bodies, frame] = [this.#bodies, this.#frame];
    if (!bodies || !frame) return [];
    const { dimensions: d, positions_m, velocities_m_s: v } = frame;
    return [...bodies.agents].map((index) => ({
      index,
      x_m: positions_m[d * index]!,
      y_m: positions_m[d * index + 1]!,
      altitude_m: d === 3 ? positions_m[3 * index + 2]! : (this.#scene.traffic?.level_m ?? 0),
      velocity_m_s: velocityAt(v, index),
      isAlert: ALERTS.includes(frame.conditions[index]!),
    }));
  }

  /**
   * The color of a body of the shown frame, as drawn, in its condition or another. An alert is one in all colorings, but
   * for that by states, in which the legend says what an alert looks like.
   */
  tintOf(index: number, condition = this.#frame?.conditions[index] ?? 0): number {
    const own = this.#ownTints?.[index];
    if (own && (this.#tellsStates || !ALERTS.includes(condition))) return own;
    const appearance = this.#bodies?.table.appearance[index] ?? 0;
    return this.#tints[5 * appearance + condition] ?? 0xff888888;
  }

  #colors(): void {
    if (this.#palette) this.#tints = tintsOf(this.#bodies?.table.appearances ?? [], this.#palette);
  }

  #dropFills(): void {
    for (const mesh of this.#fills.children as Mesh[]) {
      mesh.geometry.dispose();
      (mesh.material as RawShaderMaterial).dispose();
    }
    this.#fills.clear();
  }

  #fillAreas(): void {
    const palette = this.#palette;
    if (!palette) return;
    this.#dropFills();
    this.#borders.begin();
    const tint = packColor(areaColor(palette), 0.9);
    for (const area of this.areas) {
      if (!area.area.is_fence) this.#fills.add(fillArea(area, palette, this.#ratio));
      for (const ring of area.rings_m)
        this.#borders.path(ring, area.area.is_fence ? 1.8 : 1.3, tint, area.area.is_fence);
    }
    this.#borders.end();
  }

  #drawMoving(): void {
    const [bodies, frame] = [this.#bodies, this.#frame];
    if (!bodies || !frame || !this.#palette) return;
    this.#drawZones(bodies, frame);
    this.#drawRoutes(bodies);
    this.#drawVectors();
    const all = this.#hidesAgents ? [] : this.aircraft();
    this.#symbols.begin(all.length);
    // Those in conflict lie over the others.
    for (const { index, x_m, y_m } of all.sort((a, b) => Number(a.isAlert) - Number(b.isAlert) || a.index - b.index))
      this.#symbols.add(x_m, y_m, headingOf(frame, index), 1e-3, 0.72e-3, DART, SYMBOL_PX, this.tintOf(index));
    this.#symbols.end();
  }

  #isInFocus(index: number): boolean {
    return index === this.#selected || index === this.#hovered;
  }

  #drawZones(bodies: Bodies, frame: Frame): void {
    this.#zones.begin(this.#zoneOf.size);
    for (const [agent, zone] of this.#zoneOf) {
      const isAlert = ALERTS.includes(frame.conditions[zone]!);
      if (!isAlert && !this.#isInFocus(agent)) continue;
      const radius_m = flatRadiusOf(bodies.table.shapes[bodies.table.shape[zone]!]!);
      const color = this.tintOf(agent, frame.conditions[zone]!) & 0xffffff;
      const tint = ((isAlert ? 0x40 : 0x12) << 24) | color;
      const d = frame.dimensions;
      const [x, y] = [frame.positions_m[d * zone]!, frame.positions_m[d * zone + 1]!];
      this.#zones.add(x, y, 0, radius_m, radius_m, DISC, 0, tint >>> 0);
    }
    this.#zones.end();
  }

  #drawRoutes(bodies: Bodies): void {
    this.#routes.begin();
    const routes = this.#scene.traffic?.routes ?? [];
    const shown = routes.flatMap((route) => {
      const index = bodies.find(route.agent);
      return index === undefined ? [] : [{ route, index }];
    });
    const isQuiet = this.#selected === undefined && shown.length <= MAX_ROUTES;
    for (const { route, index } of shown) {
      if (!isQuiet && !this.#isInFocus(index)) continue;
      const color = this.tintOf(index) & 0xffffff;
      const alpha = this.#isInFocus(index) ? 0xc0 : 0x50;
      const points = route.points_m.map(([x, y]) => [x, y, 0]);
      this.#routes.path(points, 1, ((alpha << 24) | color) >>> 0, true);
      for (const point of points.slice(1)) this.#routes.dot(point, 5, ((alpha << 24) | color) >>> 0);
    }
    this.#routes.end();
  }

  #drawVectors(): void {
    this.#vectors.begin();
    const ahead_s = this.lookahead_s;
    for (const { index, x_m, y_m, velocity_m_s } of this.#hidesAgents ? [] : this.aircraft()) {
      if (!velocity_m_s) continue;
      const end = [x_m + ahead_s * velocity_m_s[0], y_m + ahead_s * velocity_m_s[1], 0];
      this.#vectors.piece([x_m, y_m, 0], end, 1.6, 0, this.tintOf(index));
    }
    this.#vectors.end();
  }
}

/** A velocity of a column; null where a recording has none, of which all are zero. */
function velocityAt(velocities_m_s: Float32Array, index: number): Aircraft["velocity_m_s"] {
  const velocity = [0, 1, 2].map((k) => velocities_m_s[3 * index + k] ?? 0) as [number, number, number];
  return velocity.some((speed) => speed !== 0) ? velocity : null;
}

/** The heading of a body, which turns about the vertical axis alone. */
function headingOf(frame: Frame, index: number): number {
  if (frame.dimensions === 2) return frame.orientations[index]!;
  return 2 * Math.atan2(frame.orientations[4 * index + 2]!, frame.orientations[4 * index + 3]!);
}

/** The zone of each agent: the disc that has the number of the agent. */
function zonesOf(bodies: Bodies): Map<number, number> {
  const { table } = bodies;
  const discs = new Map<number, number>();
  for (let i = 0; i < bodies.count; i++) {
    const isDisc = table.shapes[table.shape[i]!]!.type === "cylinder";
    if (isDisc && !table.is_agent[i]) discs.set(table.number[i]!, i);
  }
  const zones = new Map<number, number>();
  for (const agent of bodies.agents) {
    const zone = discs.get(table.number[agent]!);
    if (zone !== undefined) zones.set(agent, zone);
  }
  return zones;
}

/** A packed color for the pen of a canvas. */
export function cssOfTint(tint: number): string {
  return `rgb(${tint & 255} ${(tint >>> 8) & 255} ${(tint >>> 16) & 255})`;
}

/** The color of the text of an alert, where colors are not those of states. */
function alertInk(palette: Palette): [number, number, number] {
  return visibleColor([0xd0, 0x10, 0x10], palette);
}
