/** The metrics of each agent, of which one at a time is asked for while bodies are colored by it. */

import type { MetricName, ReplyBody } from "../protocol";
import type { AgentValues } from "./color-mode";
import { Pace } from "./pace";

/** Asks for the names of metrics, or for the values of one. */
type FetchMetrics = (metric: string | null) => Promise<ReplyBody>;

export class AgentMetrics {
  /** The metrics that can be asked for; null before they are known. */
  names = $state.raw<MetricName[] | null>(null);
  values = $state.raw<AgentValues | null>(null);
  #isFetching = false;
  /** The cycle of the last request for values. */
  #askedCycle = -1;
  readonly #pace = new Pace();
  #age = 0;

  clear(): void {
    this.names = null;
    this.values = null;
    this.#age++;
    this.#isFetching = false;
    this.#askedCycle = -1;
    this.#pace.reset();
  }

  /** Fetches the names, if they are not known. */
  async fetchNames(ask: FetchMetrics): Promise<void> {
    if (this.names !== null) return;
    await this.#fetch(null, ask);
  }

  /** Fetches the values of a metric at a cycle, if those that are known are of another one. */
  async fetchValues(metric: string, cycle: number, ask: FetchMetrics): Promise<void> {
    const { values } = this;
    if (values?.key === metric) {
      if (values.cycle === cycle) this.#askedCycle = cycle;
      // A recording may have no row of this cycle, and answers with an earlier one each time.
      const isAnswered = this.#askedCycle === cycle && values.cycle <= cycle;
      if (isAnswered || !this.#pace.isDue) return;
    }
    this.#askedCycle = cycle;
    await this.#fetch(metric, ask);
  }

  async #fetch(metric: string | null, ask: FetchMetrics): Promise<void> {
    if (this.#isFetching) return;
    const age = this.#age;
    this.#isFetching = true;
    const sentAt_ms = performance.now();
    try {
      const answer = await ask(metric);
      if (age !== this.#age || answer.is !== "agent-metrics") return;
      this.#pace.onReply(sentAt_ms);
      if (metric === null) this.names = answer.names;
      else this.values = this.#valuesOf(metric, answer.cycle, answer.values);
    } finally {
      if (age === this.#age) this.#isFetching = false;
    }
  }

  #valuesOf(key: string, cycle: number, values: readonly (number | null)[]): AgentValues {
    const name = this.names?.find((one) => one.key === key);
    return { key, label: name?.label ?? key, unit: name?.unit ?? "", cycle, values };
  }
}
