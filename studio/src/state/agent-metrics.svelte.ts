/** The metrics of each agent, of which one at a time is asked for while bodies are colored by it. */

import type { MetricName, ReplyBody } from "../protocol";
import type { AgentValues } from "./color-mode";

/** The server computes the metrics of all agents for a request: it spends no more than a tenth of the time on it. */
const MIN_PAUSE_PER_REPLY = 10;

/** Asks for the names of metrics, or for the values of one. */
type FetchMetrics = (metric: string | null) => Promise<ReplyBody>;

export class AgentMetrics {
  /** The metrics that can be asked for; null before they are known. */
  names = $state.raw<MetricName[] | null>(null);
  values = $state.raw<AgentValues | null>(null);
  /** The request under way. */
  #fetching: Promise<void> | null = null;
  /** The metric and the cycle of the last reply: a replay answers with the values of an earlier cycle. */
  #last = { metric: "", cycle: NaN };
  #dueAt_ms = 0;
  #age = 0;

  clear(): void {
    this.names = null;
    this.values = null;
    this.#age++;
    this.#fetching = null;
    this.#last = { metric: "", cycle: NaN };
    this.#dueAt_ms = 0;
  }

  /** Fetches the names, if they are not known. */
  async fetchNames(ask: FetchMetrics): Promise<void> {
    if (this.names !== null) return;
    await this.#fetch(null, NaN, ask);
  }

  /** Fetches the values of a metric at a cycle, if those that are known are of another one. */
  async fetchValues(metric: string, cycle: number, ask: FetchMetrics): Promise<void> {
    if (this.#isKnown(metric, cycle)) return;
    if (this.values?.key === metric && performance.now() < this.#dueAt_ms) return;
    await this.#fetch(metric, cycle, ask);
  }

  /** Fetches the values at a cycle whatever they cost: a picture that is kept shows none of another cycle. */
  async completeValues(metric: string, cycle: number, ask: FetchMetrics): Promise<void> {
    await this.#fetching?.catch(() => undefined);
    if (!this.#isKnown(metric, cycle)) await this.#fetch(metric, cycle, ask);
  }

  #isKnown(metric: string, cycle: number): boolean {
    return this.values?.key === metric && this.#last.metric === metric && this.#last.cycle === cycle;
  }

  async #fetch(metric: string | null, cycle: number, ask: FetchMetrics): Promise<void> {
    if (this.#fetching) return;
    const age = this.#age;
    this.#fetching = this.#request(metric, cycle, ask);
    try {
      await this.#fetching;
    } finally {
      if (age === this.#age) this.#fetching = null;
    }
  }

  async #request(metric: string | null, cycle: number, ask: FetchMetrics): Promise<void> {
    const age = this.#age;
    const began_ms = performance.now();
    const answer = await ask(metric);
    if (age !== this.#age || answer.is !== "agent-metrics") return;
    const now_ms = performance.now();
    this.#dueAt_ms = now_ms + MIN_PAUSE_PER_REPLY * (now_ms - began_ms);
    if (metric === null) return void (this.names = answer.names);
    this.#last = { metric, cycle: Math.max(cycle, answer.cycle) };
    this.values = this.#valuesOf(metric, answer.cycle, answer.values);
  }

  #valuesOf(key: string, cycle: number, values: readonly (number | null)[]): AgentValues {
    const name = this.names?.find((one) => one.key === key);
    return { key, label: name?.label ?? key, unit: name?.unit ?? "", cycle, values };
  }
}
