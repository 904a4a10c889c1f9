/** Draws the bodies of a 3-D frame as solids. */

import { Group } from "three";
import type { Frame } from "../decode";
import type { Scene, Shape } from "../protocol";
import type { Bodies } from "../state/bodies";
import { packAppearance, tintsOf, type Palette } from "./palette";
import { Solids, rotationTo, type SolidKind } from "./solids";
import type { Painter, ViewScale } from "./viewport";

const KINDS: readonly SolidKind[] = ["ball", "box", "cylinder", "dart"];

/** Minimum ratio of the drawn width of a rod to its length. */
const MIN_WIDTH_TO_LENGTH = 0.02;

/** Number of glass bodies from which they cost more than all else in a picture. */
const MANY_GLASS = 1000;

/** Minimum radius of moving balls. */
const MIN_BALL_PX = 1.6;

/** Opaque and transparent solids of each kind. */
class SolidLayers {
  readonly #solids: Record<SolidKind, [Solids, Solids]>;

  constructor(opaque: Group, glass: Group) {
    const both = (kind: SolidKind): [Solids, Solids] => [new Solids(kind, false), new Solids(kind, true)];
    this.#solids = { ball: both("ball"), box: both("box"), cylinder: both("cylinder"), dart: both("dart") };
    for (const kind of KINDS) {
      opaque.add(this.#solids[kind][0].instances.mesh);
      glass.add(this.#solids[kind][1].instances.mesh);
    }
  }

  /** Number of glass bodies. */
  get glassCount(): number {
    return KINDS.reduce((sum, kind) => sum + this.#solids[kind][1].count, 0);
  }

  #all(): Solids[] {
    return KINDS.flatMap((kind) => this.#solids[kind]);
  }

  setMinRadius(ofDistance: number): void {
    for (const solids of this.#solids.ball) solids.setMinRadius(ofDistance);
  }

  begin(): void {
    for (const solids of this.#all()) solids.begin();
  }

  end(): void {
    for (const solids of this.#all()) solids.end();
  }

  of(kind: SolidKind, tint: number): Solids {
    return this.#solids[kind][tint >>> 24 < 253 ? 1 : 0];
  }

  body(shape: Shape, at: ArrayLike<number>, turn: ArrayLike<number>, tint: number): void {
    if (shape.type === "sphere") return this.of("ball", tint).ball(at[0]!, at[1]!, at[2]!, shape.radius_m, tint);
    if (shape.type === "cuboid") return this.of("box", tint).mesh(at, turn, shape.size_m, tint);
    if (shape.type === "cylinder") {
      const wide = 2 * shape.radius_m;
      return this.of("cylinder", tint).mesh(at, turn, [wide, wide, shape.height_m], tint);
    }
    if (shape.type === "dart") {
      const size = [shape.length_m, shape.width_m, 0.3 * shape.width_m] as const;
      this.of("dart", tint).mesh(at, turn, size, tint);
    }
  }

  rod(a: ArrayLike<number>, b: ArrayLike<number>, thickness_m: number, tint: number): void {
    const [dx, dy, dz] = [b[0]! - a[0]!, b[1]! - a[1]!, b[2]! - a[2]!];
    const length = Math.hypot(dx, dy, dz);
    const wide = Math.max(thickness_m, MIN_WIDTH_TO_LENGTH * length);
    const middle = [0, 1, 2].map((k) => 0.5 * (a[k]! + b[k]!));
    this.of("cylinder", tint).mesh(middle, rotationTo(dx, dy, dz), [wide, wide, length], tint);
  }
}

export class SpacePainter implements Painter {
  readonly group = new Group();
  /** Glass bodies at rest. */
  readonly #glass = new Group();
  readonly #static = new SolidLayers(this.group, this.#glass);
  readonly #moving = new SolidLayers(this.group, this.group);
  readonly #scene: Scene;
  #bodies: Bodies | null = null;
  #tints: Uint32Array = new Uint32Array(0);
  /** The colors of bodies that do not have their usual ones. */
  #ownTints: Uint32Array | null = null;

  constructor(scene: Scene) {
    this.#scene = scene;
  }

  /** The glass bodies at rest, where they are so many that they are to be drawn apart; null else. Call it after `paint`. */
  takeGlass(): Group | null {
    if (this.#static.glassCount >= MANY_GLASS) return this.#glass;
    this.group.add(this.#glass);
    return null;
  }

  paint(palette: Palette): void {
    this.#static.begin();
    for (const { shape, at_m, orientation: turn, appearance: look } of this.#scene.bodies) {
      const tint = packAppearance(look, palette);
      if (shape.type !== "line") this.#static.body(shape, at_m, turn, tint);
      else shape.points_m.slice(1).forEach((b, i) => this.#static.rod(shape.points_m[i]!, b, shape.thickness_m, tint));
    }
    this.#static.end();
    this.#colors(palette);
  }

  setBodies(bodies: Bodies, palette: Palette): void {
    this.#bodies = bodies;
    this.#colors(palette);
  }

  #colors(palette: Palette): void {
    this.#tints = tintsOf(this.#bodies?.table.appearances ?? [], palette);
  }

  setColors(tints: Uint32Array | null): void {
    this.#ownTints = tints;
  }

  frame(frame: Frame): void {
    const bodies = this.#bodies;
    if (!bodies) return;
    const { table } = bodies;
    const { positions_m, orientations, points_m, lineStarts } = frame;
    this.#moving.begin();
    let line = 0;
    for (let i = 0; i < frame.bodies; i++) {
      const shape = table.shapes[table.shape[i]!]!;
      const tint = this.#ownTints?.[i] || this.#tints[5 * table.appearance[i]! + frame.conditions[i]!]!;
      if (shape.type === "line") {
        for (let p = lineStarts[line]! + 1; p < lineStarts[line + 1]!; p++) {
          const a = points_m.subarray(3 * p - 3, 3 * p);
          this.#moving.rod(a, points_m.subarray(3 * p, 3 * p + 3), shape.thickness_m, tint);
        }
        line++;
      } else {
        this.#moving.body(shape, positions_m.subarray(3 * i, 3 * i + 3), orientations.subarray(4 * i, 4 * i + 4), tint);
      }
    }
    this.#moving.end();
  }

  scale({ height_px }: ViewScale): void {
    // Half a field of view of 20 degrees reaches over half the height.
    this.#moving.setMinRadius((MIN_BALL_PX * 2 * Math.tan(Math.PI / 9)) / Math.max(1, height_px));
  }

  dispose(): void {
    for (const group of [this.group, this.#glass])
      group.traverse((object) => {
        if ("geometry" in object) (object.geometry as { dispose(): void }).dispose();
      });
  }
}
