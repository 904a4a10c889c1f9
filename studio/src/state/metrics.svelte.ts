/** A session's metrics over time: exact values at cycles that the server has kept by their numbers. */

import type { MetricName, MetricRow, ReplyBody } from "../protocol";
import { isConstant } from "../rounding";

type MetricsReply = Extract<ReplyBody, { is: "metrics" }>;

/** The value of a metric, and the cycle that it belongs to. */
export interface CycleValue {
  cycle: number;
  /** Null where the metric has no value at this cycle. */
  value: number | null;
}

export class Metrics {
  names = $state.raw<MetricName[]>([]);
  /** Cycles of the rows, and a column for each metric; replaced when rows come. */
  cycles = $state.raw<number[]>([]);
  columns = $state.raw<(number | null)[][]>([]);
  /** The metrics of one more cycle, at which the server was when it was asked last. */
  present = $state.raw<MetricRow | null>(null);
  #isFetching = false;
  #age = 0;

  clear(): void {
    this.cycles = [];
    this.columns = [];
    this.present = null;
    this.#age++;
    this.#isFetching = false;
  }

  /**
   * The metrics to chart where nobody has chosen any: the first of those that the world is about, and of these the ones
   * that have changed where there are enough; in their own order, so that none changes its place.
   */
  defaultKeys(count: number): string[] {
    const isTold = this.names.some((name) => name.is_primary);
    const keys = this.names.filter((name) => name.is_primary || !isTold).map(({ key }) => key);
    const changed = keys.filter((key) => this.#hasChanged(key));
    const constant = keys.filter((key) => !changed.includes(key));
    const chosen = [...changed, ...constant].slice(0, count);
    return keys.filter((key) => chosen.includes(key));
  }

  /** The rows of a metric for a chart, with that of the present cycle in its place. */
  curve(key: string): { cycles: number[]; values: (number | null)[] } {
    const index = this.#indexOf(key);
    const values = this.columns[index] ?? [];
    const { cycles, present } = this;
    if (!present || index < 0) return { cycles, values };
    const at = cycles.findLastIndex((cycle) => cycle <= present.cycle) + 1;
    if (cycles[at - 1] === present.cycle) return { cycles, values };
    const value = present.values[index] ?? null;
    return {
      cycles: [...cycles.slice(0, at), present.cycle, ...cycles.slice(at)],
      values: [...values.slice(0, at), value, ...values.slice(at)],
    };
  }

  /** The value of a metric at the last cycle up to this one of which it is known. */
  valueAt(key: string, cycle: number): CycleValue | null {
    const { cycles, values } = this.curve(key);
    const at = cycles.findLastIndex((one) => one <= cycle);
    return at < 0 ? null : { cycle: cycles[at]!, value: values[at] ?? null };
  }

  /** Fetches the rows since the last known one, and the present metrics. */
  async fetch(ask: (from: number) => Promise<ReplyBody>): Promise<void> {
    if (this.#isFetching) return;
    const age = this.#age;
    this.#isFetching = true;
    try {
      const answer = await ask(this.cycles.length);
      if (age === this.#age && answer.is === "metrics") this.#append(answer);
    } finally {
      if (age === this.#age) this.#isFetching = false;
    }
  }

  #append(answer: MetricsReply): void {
    const isSame = sameNames(this.names, answer.names);
    if (!isSame) this.names = answer.names;
    if (!isSame || answer.present?.cycle !== this.present?.cycle) this.present = answer.present;
    if (isSame && answer.cycles.length === 0 && answer.first === this.cycles.length) return;
    this.cycles = [...this.cycles.slice(0, answer.first), ...answer.cycles];
    this.columns = answer.values.map((values, i) => [...(this.columns[i] ?? []).slice(0, answer.first), ...values]);
  }

  #indexOf(key: string): number {
    return this.names.findIndex((name) => name.key === key);
  }

  /** Returns whether a metric has had two values that differ by more than rounding does. */
  #hasChanged(key: string): boolean {
    const values = this.curve(key).values.filter((value) => value !== null);
    const [first = 0] = values;
    return values.some((value) => !isConstant(Math.min(value, first), Math.max(value, first)));
  }
}

/** A metric's label with its unit. */
export function metricLabel({ label, unit }: MetricName): string {
  return unit ? `${label}, ${unit}` : label;
}

function sameNames(a: MetricName[], b: MetricName[]): boolean {
  return a.length === b.length && a.every((name, i) => name.key === b[i]!.key);
}
