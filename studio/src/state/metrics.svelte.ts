/** Samples of a session's metrics. */

import type { ReplyBody, MetricName } from "../protocol";

export class Metrics {
  names = $state.raw<MetricName[]>([]);
  /** Cycles of the samples, and a column for each metric; replaced when samples come. */
  cycles = $state.raw<number[]>([]);
  columns = $state.raw<(number | null)[][]>([]);
  /** The number of times that the server halved the number of samples, which renumbers them. */
  #thinned = 0;
  #isFetching = false;
  #age = 0;

  clear(): void {
    this.cycles = [];
    this.columns = [];
    this.#thinned = 0;
    this.#age++;
    this.#isFetching = false;
  }

  /** Keys of the metrics in the order of their first change; constant ones last. */
  get keysByFirstChange(): string[] {
    const since = this.columns.map((column) => {
      const at = column.findIndex((value) => value !== null && value !== column[0]);
      return at < 0 ? Infinity : at;
    });
    const order = this.names.map((_, i) => i).sort((a, b) => (since[a] === since[b] ? a - b : since[a]! - since[b]!));
    return order.map((i) => this.names[i]!.key);
  }

  /** Fetches the samples since the last known one. */
  async fetch(ask: (from: number) => Promise<ReplyBody>): Promise<void> {
    if (this.#isFetching) return;
    const age = this.#age;
    this.#isFetching = true;
    try {
      const answer = await ask(this.cycles.length);
      if (age !== this.#age || answer.is !== "metrics") return;
      if (answer.thinned !== this.#thinned) this.#restart(answer.thinned);
      else this.#append(answer);
    } finally {
      if (age === this.#age) this.#isFetching = false;
    }
  }

  /** Starts over after a renumbering: the next request is for all samples. */
  #restart(thinned: number): void {
    this.#thinned = thinned;
    this.cycles = [];
    this.columns = [];
  }

  #append(answer: Extract<ReplyBody, { is: "metrics" }>): void {
    const isSame = sameNames(this.names, answer.names);
    if (isSame && answer.cycles.length === 0 && answer.first === this.cycles.length) return;
    const known = new Map(this.names.map(({ key }, i) => [key, this.columns[i] ?? []]));
    this.cycles = [...this.cycles.slice(0, answer.first), ...answer.cycles];
    this.columns = answer.names.map(({ key }, i) => [
      ...padColumn(known.get(key) ?? [], answer.first),
      ...(answer.values[i] ?? []),
    ]);
    if (!isSame) this.names = answer.names;
  }
}

/** The first samples of a column; a metric that appeared later had no value before. */
function padColumn(column: (number | null)[], length: number): (number | null)[] {
  const missing = Math.max(0, length - column.length);
  return [...column.slice(0, length), ...Array<null>(missing).fill(null)];
}

/** A metric's label with its unit. */
export function metricLabel({ label, unit }: MetricName): string {
  return unit ? `${label}, ${unit}` : label;
}

function sameNames(a: MetricName[], b: MetricName[]): boolean {
  return a.length === b.length && a.every((name, i) => name.key === b[i]!.key);
}
