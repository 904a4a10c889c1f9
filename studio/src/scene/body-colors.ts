/** The colors of bodies by what a reader asks for, or many agents as a density; and what the colors stand for. */

import { number } from "../format";
import type { Frame } from "../decode";
import type { Scene } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { AgentValues, ColorMode, DensityMode } from "../state/color-mode";
import { PlaneCamera, type Camera } from "./camera";
import { Coloring, type ColorLegend } from "./coloring";
import { cellsOf, DensityLayer, doSymbolsCrowd, isCrowd } from "./density";
import { flatRadiusOf } from "./extent";
import type { Palette, Rgb } from "./palette";
import { SYMBOL_PX } from "./plan";

/** What a reader asks for. */
export interface ColorOptions {
  colors: ColorMode;
  density: DensityMode;
  /** The metric of agents that they are colored by. */
  agentValues: AgentValues | null;
}

/** What colors depend on beside the frame. */
interface Look {
  camera: Camera;
  size_px: readonly [number, number];
  options: ColorOptions;
  palette: Palette;
}

export class BodyColors {
  readonly density = new DensityLayer();
  /** Whether agents are shown as a density, and not as bodies. */
  isDense = false;
  legend: ColorLegend | null = null;
  readonly #bodies: Bodies;
  readonly #scene: Scene;
  readonly #coloring: Coloring;
  /** What the present colors were made from. */
  #made: { frame: Frame; colors: ColorMode; values: AgentValues | null; palette: Palette; isDense: boolean } | null =
    null;
  /** The camera that the cells of the density were made for. */
  #cellsKey = "";

  constructor(bodies: Bodies, scene: Scene) {
    this.#bodies = bodies;
    this.#scene = scene;
    this.#coloring = new Coloring(bodies, scene.dimensions === 2 ? 2 : 3, scene.cycle_s);
  }

  /** The color of each body in packed form, 0 for its own; null where all have their own. */
  get tints(): Uint32Array | null {
    return this.#coloring.tints;
  }

  /** The color of a body; null if it has its own. */
  colorOf(index: number): Rgb | null {
    const tint = this.tints?.[index] ?? 0;
    return tint === 0 ? null : [tint & 255, (tint >> 8) & 255, (tint >> 16) & 255];
  }

  /** Takes the motion of a frame. */
  push(frame: Frame, isSought: boolean): void {
    this.#coloring.motion.push(frame.cycle, frame.positions_m, isSought);
  }

  /** Colors a frame. Returns whether bodies look different now. */
  update(frame: Frame, look: Look): boolean {
    const { camera, size_px, options, palette } = look;
    const isDense = this.#showsDensity(frame, look);
    const wanted = { frame, colors: options.colors, values: options.agentValues, palette, isDense };
    const isChanged = !isSame(wanted, this.#made);
    this.#made = wanted;
    this.isDense = this.density.mesh.visible = isDense;
    if (isChanged) {
      this.#coloring.setMode(options.colors);
      this.#coloring.update(frame, options.agentValues, palette);
      this.legend = this.#coloring.legend;
    }
    if (isDense) this.#drawDensity(frame, camera as PlaneCamera, size_px, palette, isChanged);
    return isChanged;
  }

  #showsDensity(frame: Frame, { camera, size_px, options: { density } }: Look): boolean {
    if (density === "off" || !(camera instanceof PlaneCamera)) return false;
    if (density === "on") return true;
    const { table, agents } = this.#bodies;
    // Traffic that is seen from above has symbols.
    if (this.#scene.traffic !== null) return doSymbolsCrowd(frame, agents, camera, size_px, 2 * SYMBOL_PX);
    const size_m = agents.length === 0 ? 0 : 2 * flatRadiusOf(table.shapes[table.shape[agents[0]!]!]!);
    return isCrowd(this.#bodies, size_m, 1 / camera.mPerPx);
  }

  #drawDensity(
    frame: Frame,
    camera: PlaneCamera,
    size_px: readonly [number, number],
    palette: Palette,
    isChanged: boolean,
  ): void {
    const key = [camera.x, camera.y, camera.mPerPx, ...size_px].join(" ");
    if (!isChanged && key === this.#cellsKey) return;
    this.#cellsKey = key;
    const { values, range } = this.#coloring;
    const scale = values && { values, ends: range.ends };
    this.density.draw(cellsOf(camera, size_px), frame, this.#bodies, scale, palette);
    this.legend = this.#densityLegend(this.#coloring.legend);
  }

  /** The meaning of a density: numbers of agents, or means of what they are colored by. */
  #densityLegend(legend: ColorLegend | null): ColorLegend {
    const cells = `cells of ${number(this.density.side_m)}\u202fm`;
    if (legend?.kind === "scale") {
      const note = [legend.note, `mean in ${cells}`].filter((words) => words !== "").join(", ");
      return { ...legend, note };
    }
    const { ends } = this.density.range;
    return {
      kind: "scale",
      title: "Density",
      unit: `${this.#scene.agent}s in a cell`,
      ends,
      note: cells,
      hasNone: false,
    };
  }
}

function isSame<T extends object>(a: T, b: T | null): boolean {
  return b !== null && (Object.keys(a) as (keyof T)[]).every((key) => a[key] === b[key]);
}
