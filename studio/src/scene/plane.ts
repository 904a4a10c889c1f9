/** Bodies of the plane, from a frame into glyphs. */

import { Group } from "three";
import type { Frame } from "../decode";
import type { Scene, Shape } from "../protocol";
import type { Bodies } from "../state/cast";
import { BOX, DART, DISC, Glyphs } from "./glyphs";
import { packed, tintsOf, type Palette } from "./palette";
import type { Painter } from "./stage";

/** Agents stay visible from afar: least half length in pixels. */
const LEAST_DART_PX = 7;
const LEAST_AGENT_PX = 1.5;

interface Form {
  half: [number, number];
  kind: number;
}

function formOf(shape: Shape): Form {
  if (shape.type === "cuboid") return { half: [0.5 * shape.size_m[0], 0.5 * shape.size_m[1]], kind: BOX };
  if (shape.type === "dart") return { half: [0.5 * shape.length_m, 0.5 * shape.width_m], kind: DART };
  const radius = shape.type === "line" ? 0.5 * shape.thickness_m : shape.radius_m;
  return { half: [radius, radius], kind: DISC };
}

/** Bodies in the order in which they cover each other. */
function byLayer(bodies: Bodies): { index: number; line: number }[] {
  const lines = new Map([...bodies.lines].map((index, line) => [index, line]));
  const layer = (index: number): number => bodies.cast.looks[bodies.cast.look[index]!]![0].layer;
  return Array.from({ length: bodies.count }, (_, index) => ({ index, line: lines.get(index) ?? -1 })).sort(
    (a, b) => layer(a.index) - layer(b.index) || a.index - b.index,
  );
}

/** Glyphs that the still bodies of a scene need. */
function piecesOf(scene: Scene): number {
  return scene.bodies.reduce((n, { shape }) => n + (shape.type === "line" ? shape.points_m.length : 1), 0);
}

export class PlanePainter implements Painter {
  readonly group = new Group();
  readonly #still = new Glyphs(2);
  readonly #moving = new Glyphs(3);
  readonly #scene: Scene;
  #bodies: Bodies | null = null;
  #order = new Uint32Array(0);
  #lineOf = new Int32Array(0);
  #forms: Form[] = [];
  #tints: Uint32Array = new Uint32Array(0);

  constructor(scene: Scene) {
    this.#scene = scene;
    this.group.add(this.#still.quads.mesh, this.#moving.quads.mesh);
  }

  paint(palette: Palette): void {
    this.#still.begin(piecesOf(this.#scene));
    for (const body of [...this.#scene.bodies].sort((a, b) => a.look.layer - b.look.layer)) {
      const tint = packed(body.look, palette);
      if (body.shape.type === "line") {
        const points = body.shape.points_m;
        for (let i = 1; i < points.length; i++) {
          this.#still.rod(
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
      const [, , qz, qw] = body.turn;
      this.#still.add(body.at_m[0], body.at_m[1], 2 * Math.atan2(qz, qw), half[0], half[1], kind, 0, tint);
    }
    this.#still.end();
    this.#colors(palette);
  }

  cast(bodies: Bodies, palette: Palette): void {
    this.#bodies = bodies;
    const order = byLayer(bodies);
    this.#order = Uint32Array.from(order, ({ index }) => index);
    this.#lineOf = Int32Array.from(order, ({ line }) => line);
    this.#forms = bodies.cast.shapes.map(formOf);
    this.#colors(palette);
  }

  #colors(palette: Palette): void {
    this.#tints = tintsOf(this.#bodies?.cast.looks ?? [], palette);
  }

  frame(frame: Frame): void {
    const bodies = this.#bodies;
    if (!bodies) return;
    const { cast } = bodies;
    const glyphs = this.#moving;
    glyphs.begin(frame.bodies + frame.points_m.length / 2);
    for (let k = 0; k < this.#order.length; k++) {
      const i = this.#order[k]!;
      const tint = this.#tints[5 * cast.look[i]! + frame.conditions[i]!]!;
      if (this.#lineOf[k]! >= 0) {
        this.#rods(frame, this.#lineOf[k]!, cast.shapes[cast.shape[i]!]!, tint);
        continue;
      }
      const { half, kind } = this.#forms[cast.shape[i]!]!;
      const least = !cast.is_agent[i] ? 0 : kind === DART ? LEAST_DART_PX : LEAST_AGENT_PX;
      glyphs.add(
        frame.places_m[2 * i]!,
        frame.places_m[2 * i + 1]!,
        frame.turns[i]!,
        half[0],
        half[1],
        kind,
        least,
        tint,
      );
    }
    glyphs.end();
  }

  #rods(frame: Frame, line: number, shape: Shape, tint: number): void {
    const thickness = shape.type === "line" ? shape.thickness_m : 0;
    const p = frame.points_m;
    for (let i = frame.lineStarts[line]! + 1; i < frame.lineStarts[line + 1]!; i++) {
      this.#moving.rod(p[2 * i - 2]!, p[2 * i - 1]!, p[2 * i]!, p[2 * i + 1]!, thickness, tint);
    }
  }

  scale(pxPerM: number, palette: Palette): void {
    this.#still.scale(pxPerM, palette);
    this.#moving.scale(pxPerM, palette);
  }

  dispose(): void {
    this.#still.quads.dispose();
    this.#moving.quads.dispose();
  }
}
