/** Samples of a session's metrics. */

import type { Answer, MetricName } from "../protocol";

export class Metrics {
  names = $state.raw<MetricName[]>([]);
  /** Cycles of the samples, and a column for each metric; replaced when samples come. */
  cycles = $state.raw<number[]>([]);
  columns = $state.raw<(number | null)[][]>([]);
  /** The number of times that the server halved the number of samples, which renumbers them. */
  #thinned = 0;
  #isAsking = false;
  #age = 0;

  clear(): void {
    this.cycles = [];
    this.columns = [];
    this.#thinned = 0;
    this.#age++;
    this.#isAsking = false;
  }

  /** Keys of the metrics: those that changed first come first, those that never did last. */
  get lively(): string[] {
    const since = this.columns.map((column) => {
      const at = column.findIndex((value) => value !== null && value !== column[0]);
      return at < 0 ? Infinity : at;
    });
    const order = this.names.map((_, i) => i).sort((a, b) => (since[a] === since[b] ? a - b : since[a]! - since[b]!));
    return order.map((i) => this.names[i]!.key);
  }

  /** Fetches the samples since the last known one. */
  async fetch(ask: (from: number) => Promise<Answer>): Promise<void> {
    if (this.#isAsking) return;
    const age = this.#age;
    this.#isAsking = true;
    try {
      const answer = await ask(this.cycles.length);
      if (age !== this.#age || answer.is !== "metrics") return;
      if (answer.thinned !== this.#thinned) this.#begin(answer.thinned);
      else this.#take(answer);
    } finally {
      if (age === this.#age) this.#isAsking = false;
    }
  }

  /** Begins anew with the numbers of samples: the next question is for all of them. */
  #begin(thinned: number): void {
    this.#thinned = thinned;
    this.cycles = [];
    this.columns = [];
  }

  #take(answer: Extract<Answer, { is: "metrics" }>): void {
    const isSame = sameNames(this.names, answer.names);
    if (isSame && answer.cycles.length === 0 && answer.first === this.cycles.length) return;
    const known = new Map(this.names.map(({ key }, i) => [key, this.columns[i] ?? []]));
    this.cycles = [...this.cycles.slice(0, answer.first), ...answer.cycles];
    this.columns = answer.names.map(({ key }, i) => [
      ...padded(known.get(key) ?? [], answer.first),
      ...(answer.values[i] ?? []),
    ]);
    if (!isSame) this.names = answer.names;
  }
}

/** The first samples of a column; a metric that appeared later had no value before. */
function padded(column: (number | null)[], length: number): (number | null)[] {
  const missing = Math.max(0, length - column.length);
  return [...column.slice(0, length), ...Array<null>(missing).fill(null)];
}

/** A metric's name with its unit. */
export function metricWords({ words, unit }: MetricName): string {
  return unit ? `${words}, ${unit}` : words;
}

function sameNames(a: MetricName[], b: MetricName[]): boolean {
  return a.length === b.length && a.every((name, i) => name.key === b[i]!.key);
}
