/** Draws the bodies of a planar frame as glyphs. */

import { Group } from "three";
import type { Frame } from "../decode";
import type { Scene, Shape } from "../protocol";
import type { Bodies } from "../state/bodies";
import { Dots } from "./dots";
import { BOX, DART, DISC, Glyphs } from "./glyphs";
import { packAppearance, tintsOf, type Palette } from "./palette";
import type { Painter, ViewScale } from "./viewport";

/** Minimum half length in pixels: agents stay visible from far away. */
const MIN_DART_PX = 7;
const MIN_AGENT_PX = 1.5;

/** Bodies that reach less far than this need no shape. */
const MAX_DOT_PX = 2;
/** Maximum ratio of the sides of a body that is drawn as a square. */
const MAX_DOT_RATIO = 1.25;

interface GlyphForm {
  half: [number, number];
  kind: number;
}

/** Returns whether a body of this form is drawn as a dot at this scale. */
function isDot({ half, kind }: GlyphForm, pxPerM: number): boolean {
  if (kind !== DISC && kind !== BOX) return false;
  const long = Math.max(...half);
  return Math.max(MIN_AGENT_PX, long * pxPerM) < MAX_DOT_PX && long <= MAX_DOT_RATIO * Math.min(...half);
}

function formOf(shape: Shape): GlyphForm {
  if (shape.type === "cuboid") return { half: [0.5 * shape.size_m[0], 0.5 * shape.size_m[1]], kind: BOX };
  if (shape.type === "dart") return { half: [0.5 * shape.length_m, 0.5 * shape.width_m], kind: DART };
  const radius = shape.type === "line" ? 0.5 * shape.thickness_m : shape.radius_m;
  return { half: [radius, radius], kind: DISC };
}

/** Bodies in drawing order. */
function sortByLayer(bodies: Bodies): { index: number; line: number }[] {
  const lines = new Map([...bodies.lines].map((index, line) => [index, line]));
  const layer = (index: number): number => bodies.table.appearances[bodies.table.appearance[index]!]![0].layer;
  return Array.from({ length: bodies.count }, (_, index) => ({ index, line: lines.get(index) ?? -1 })).sort(
    (a, b) => layer(a.index) - layer(b.index) || a.index - b.index,
  );
}

/** Number of glyphs that the static bodies of a scene need. */
function glyphCount(scene: Scene): number {
  return scene.bodies.reduce((n, { shape }) => n + (shape.type === "line" ? shape.points_m.length : 1), 0);
}

export class PlanePainter implements Painter {
  readonly group = new Group();
  readonly #static = new Glyphs(2);
  readonly #moving = new Glyphs(3);
  readonly #dots = new Dots(3.5, MIN_AGENT_PX);
  readonly #scene: Scene;
  #bodies: Bodies | null = null;
  #order = new Uint32Array(0);
  #lineOf = new Int32Array(0);
  #forms: GlyphForm[] = [];
  /** The colors of bodies that do not have their usual ones. */
  #ownTints: Uint32Array | null = null;
  #hidesAgents = false;
  /** For each form, whether its agents are drawn as dots at the present scale. */
  #areDots: boolean[] = [];
  #pxPerM = 1;
  #frame: Frame | null = null;
  #tints: Uint32Array = new Uint32Array(0);

  constructor(scene: Scene) {
    this.#scene = scene;
    this.group.add(this.#static.quads.mesh, this.#moving.quads.mesh, this.#dots.points);
  }

  setColors(tints: Uint32Array | null, hidesAgents: boolean): void {
    this.#ownTints = tints;
    this.#hidesAgents = hidesAgents;
  }

  paint(palette: Palette): void {
    this.#static.begin(glyphCount(this.#scene));
    for (const body of [...this.#scene.bodies].sort((a, b) => a.appearance.layer - b.appearance.layer)) {
      const tint = packAppearance(body.appearance, palette);
      if (body.shape.type === "line") {
        const points = body.shape.points_m;
        for (let i = 1; i < points.length; i++) {
          this.#static.rod(
            points[i - 1]![0],
            points[i - 1]![1],
            points[i]![0],
            points[i]![1],
            body.shape.thickness_m,
            tint,
          );
        }
        continue;
      }
      const { half, kind } = formOf(body.shape);
      const [, , qz, qw] = body.orientation;
      this.#static.add(body.at_m[0], body.at_m[1], 2 * Math.atan2(qz, qw), half[0], half[1], kind, 0, tint);
    }
    this.#static.end();
    this.#colors(palette);
  }

  setBodies(bodies: Bodies, palette: Palette): void {
    this.#bodies = bodies;
    const order = sortByLayer(bodies);
    this.#order = Uint32Array.from(order, ({ index }) => index);
    this.#lineOf = Int32Array.from(order, ({ line }) => line);
    this.#forms = bodies.table.shapes.map(formOf);
    this.#areDots = this.#forms.map((form) => isDot(form, this.#pxPerM));
    this.#frame = null;
    this.#colors(palette);
  }

  #colors(palette: Palette): void {
    this.#tints = tintsOf(this.#bodies?.table.appearances ?? [], palette);
  }

  frame(frame: Frame): void {
    const bodies = this.#bodies;
    if (!bodies) return;
    const { table } = bodies;
    this.#frame = frame;
    const glyphs = this.#moving;
    glyphs.begin(frame.bodies + frame.points_m.length / 2);
    this.#dots.begin(this.#areDots.some(Boolean) ? frame.bodies : 0);
    for (let k = 0; k < this.#order.length; k++) {
      const i = this.#order[k]!;
      if (this.#hidesAgents && table.is_agent[i]) continue;
      const tint = this.#ownTints?.[i] || this.#tints[5 * table.appearance[i]! + frame.conditions[i]!]!;
      if (this.#lineOf[k]! >= 0) {
        this.#rods(frame, this.#lineOf[k]!, table.shapes[table.shape[i]!]!, tint);
        continue;
      }
      const { half, kind } = this.#forms[table.shape[i]!]!;
      if (this.#areDots[table.shape[i]!] && table.is_agent[i]) {
        this.#dots.add(frame.positions_m[2 * i]!, frame.positions_m[2 * i + 1]!, half[0], tint);
        continue;
      }
      const minPx = !table.is_agent[i] ? 0 : kind === DART ? MIN_DART_PX : MIN_AGENT_PX;
      glyphs.add(
        frame.positions_m[2 * i]!,
        frame.positions_m[2 * i + 1]!,
        frame.orientations[i]!,
        half[0],
        half[1],
        kind,
        minPx,
        tint,
      );
    }
    glyphs.end();
    this.#dots.end();
  }

  #rods(frame: Frame, line: number, shape: Shape, tint: number): void {
    const thickness = shape.type === "line" ? shape.thickness_m : 0;
    const p = frame.points_m;
    for (let i = frame.lineStarts[line]! + 1; i < frame.lineStarts[line + 1]!; i++) {
      this.#moving.rod(p[2 * i - 2]!, p[2 * i - 1]!, p[2 * i]!, p[2 * i + 1]!, thickness, tint);
    }
  }

  scale({ pxPerM, palette, ratio }: ViewScale): void {
    this.#static.scale(pxPerM, palette);
    this.#moving.scale(pxPerM, palette);
    this.#dots.scale(pxPerM, ratio);
    if (pxPerM === this.#pxPerM) return;
    this.#pxPerM = pxPerM;
    const areDots = this.#forms.map((form) => isDot(form, pxPerM));
    const isSame = areDots.every((dot, form) => dot === this.#areDots[form]);
    this.#areDots = areDots;
    // Bodies that have become dots or no longer are some move from one layer to the other.
    if (!isSame && this.#frame) this.frame(this.#frame);
  }

  dispose(): void {
    this.#static.quads.dispose();
    this.#moving.quads.dispose();
    this.#dots.dispose();
  }
}
