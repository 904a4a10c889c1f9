/** Colors of bodies by what a reader asks for: group, state, speed, waiting time or a metric of agents. */

import type { Frame } from "../decode";
import type { Bodies } from "../state/bodies";
import type { AgentValues, ColorMode } from "../state/color-mode";
import { Motion } from "./motion";
import { packColor, type Palette, type Rgb } from "./palette";
import { CATEGORIES, grayOf, ScaleRange, scaleColor } from "./scale";

/** What colors stand for: a scale, or categories. */
export type ColorLegend =
  | { kind: "scale"; title: string; unit: string; ends: readonly [number, number]; note: string; hasNone: boolean }
  | { kind: "categories"; title: string; entries: { name: string; color: Rgb; count: number }[] };

/** The states of bodies in the order of their codes, with colors; the usual one is gray. */
const STATES: readonly { name: string; color: Rgb | null }[] = [
  { name: "no contact", color: null },
  { name: "leads", color: [0, 114, 178] },
  { name: "open", color: [0, 158, 115] },
  { name: "touches, or too close", color: [213, 94, 0] },
  { name: "failed", color: [120, 94, 240] },
];

/** Number of steps of a scale that are told apart: more than can be seen. */
const STEPS = 256;

export class Coloring {
  mode: ColorMode = "own";
  legend: ColorLegend | null = null;
  /** A value of each body, where colors are a scale. */
  values: Float32Array | null = null;
  /** The color of each body, in packed form; 0 for its own. None where all have their own. */
  tints: Uint32Array | null = null;
  readonly range = new ScaleRange();
  readonly motion: Motion;
  readonly #bodies: Bodies;
  readonly #cycle_s: number;

  constructor(bodies: Bodies, dimensions: 2 | 3, cycle_s: number) {
    this.#bodies = bodies;
    this.#cycle_s = cycle_s;
    this.motion = new Motion(bodies.count, dimensions);
  }

  setMode(mode: ColorMode): void {
    if (mode === this.mode) return;
    this.mode = mode;
    this.range.reset();
  }

  /** Computes the colors of a frame. */
  update(frame: Frame, agents: AgentValues | null, palette: Palette): void {
    this.values = this.tints = this.legend = null;
    if (this.mode === "own") return;
    if (this.mode === "group") return this.#colorGroups(palette);
    if (this.mode === "state") return this.#colorStates(frame, palette);
    this.#colorScale(frame, agents, palette);
  }

  #colorGroups(palette: Palette): void {
    const { groups, groupOf } = this.#bodies;
    const color = (group: number): Rgb => (group < 0 ? grayOf(palette) : CATEGORIES[group % CATEGORIES.length]!);
    this.tints = this.#tintsOf((i) => packColor(color(groupOf[i]!), 1), palette);
    const entries = groups.map(({ name, count }, at) => ({ name, count, color: color(at) }));
    this.legend = { kind: "categories", title: "Group", entries };
  }

  #colorStates({ conditions }: Frame, palette: Palette): void {
    const colors = STATES.map(({ color }) => color ?? grayOf(palette));
    this.tints = this.#tintsOf((i) => packColor(colors[conditions[i]!]!, 1), palette);
    const counts = STATES.map(() => 0);
    for (const i of this.#bodies.agents) counts[conditions[i]!]!++;
    const entries = STATES.map(({ name }, at) => ({ name, color: colors[at]!, count: counts[at]! }));
    this.legend = { kind: "categories", title: "State", entries: entries.filter(({ count }) => count > 0) };
  }

  #colorScale(frame: Frame, agents: AgentValues | null, palette: Palette): void {
    const { values, title, unit, note } = this.#scaleValues(frame, agents);
    const { agents: indices } = this.#bodies;
    const ofAgents = Float32Array.from(indices, (i) => values[i]!);
    this.range.include(ofAgents);
    const [low, high] = this.range.ends;
    const gray = packColor(grayOf(palette), 1);
    const steps = Uint32Array.from({ length: STEPS }, (_, step) =>
      packColor(scaleColor(step / (STEPS - 1), palette), 1),
    );
    const tintOf = (value: number): number =>
      Number.isFinite(value) ? steps[Math.round(((STEPS - 1) * (value - low)) / (high - low))]! : gray;
    this.values = values;
    this.tints = this.#tintsOf((i) => tintOf(values[i]!), palette);
    const hasNone = ofAgents.some((value) => !Number.isFinite(value));
    this.legend = { kind: "scale", title, unit, ends: [low, high], note, hasNone };
  }

  /** The value of each body, and what it is. */
  #scaleValues(
    frame: Frame,
    agents: AgentValues | null,
  ): { values: Float32Array; title: string; unit: string; note: string } {
    const { motion } = this;
    if (this.mode === "speed") {
      const present = presentSpeeds(frame);
      if (present) return { values: present, title: "Ground speed", unit: "m/s", note: "" };
      const note = `mean over ${motion.window} cycles`;
      return { values: motion.speeds(this.#cycle_s), title: "Speed", unit: "m/s", note };
    }
    if (this.mode === "waiting") {
      const note = motion.since > 0 ? `seen since cycle ${motion.since}` : "";
      return { values: motion.waiting(), title: "Waiting time", unit: "cycles", note };
    }
    const values = new Float32Array(this.#bodies.count).fill(NaN);
    const { number } = this.#bodies.table;
    for (const i of this.#bodies.agents) values[i] = agents?.values[number[i]!] ?? NaN;
    const note = agents ? `at cycle ${agents.cycle}` : "asked for";
    return { values, title: agents?.label ?? "Metric", unit: agents?.unit ?? "", note };
  }

  /** Colors of agents, and a pale one for all else that moves, so that it is not taken for a value. */
  #tintsOf(tintOf: (index: number) => number, palette: Palette): Uint32Array {
    const { table, groupOf } = this.#bodies;
    const tints = new Uint32Array(this.#bodies.count);
    const isByGroup = this.mode === "group";
    const other = packColor(grayOf(palette), 1);
    for (let i = 0; i < tints.length; i++) {
      if (table.is_agent[i] || (isByGroup && groupOf[i]! >= 0)) tints[i] = tintOf(i);
      else if (isSolid(table.appearances[table.appearance[i]!]![0].opacity)) tints[i] = other;
    }
    return tints;
  }
}

/** The speed of each body over the ground, where frames tell velocities, in meters per second; null where none does. */
function presentSpeeds({ velocities_m_s: v }: Frame): Float32Array | null {
  // Scenes that are no traffic have none, and a recording without velocities has zeros.
  if (!v.some((speed_m_s) => speed_m_s !== 0)) return null;
  return Float32Array.from({ length: v.length / 3 }, (_, i) => Math.hypot(v[3 * i]!, v[3 * i + 1]!));
}

/** What lets others shine through, such as a zone around an agent, keeps its own color. */
function isSolid(opacity: number): boolean {
  return opacity >= 1;
}
