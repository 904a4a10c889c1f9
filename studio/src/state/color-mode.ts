/** What the colors of bodies stand for. */

/** `own`: the colors that the world gives; `metric:KEY`: a metric of agents. */
export type ColorMode = "own" | "group" | "speed" | "waiting" | "state" | `metric:${string}`;

/** Whether many agents are shown as a density: by itself from far away, always, or never. */
export type DensityMode = "auto" | "on" | "off";

/** The values of a metric of agents, by their numbers. */
export interface AgentValues {
  key: string;
  label: string;
  unit: string;
  cycle: number;
  values: readonly (number | null)[];
}

const METRIC = "metric:";

/** The metric that a mode colors by; null for the others. */
export function metricOf(mode: ColorMode): string | null {
  return mode.startsWith(METRIC) ? mode.slice(METRIC.length) : null;
}
