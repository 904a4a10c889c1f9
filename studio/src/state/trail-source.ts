/** Asks for trails that the page was not shown: after a seek, and when a run is opened that is not at its start. */

import { RequestError } from "../connection";
import type { BodyTrail } from "../protocol";
import type { SessionClient } from "./session-client.svelte";

/** Time without another seek before trails are asked for: while somebody scrubs, only the last cycle matters. */
const DELAY_MS = 60;

/** Receives trails up to a cycle. */
export type TrailReceiver = (trails: readonly BodyTrail[], until: number) => void;

export class TrailSource {
  readonly #client: SessionClient;
  #timer: ReturnType<typeof setTimeout> | null = null;
  #requests = 0;

  constructor(client: SessionClient) {
    this.#client = client;
  }

  /** Asks for the trails of all agents up to a cycle, unless another request follows at once. */
  request(until: number, receive: TrailReceiver): void {
    const request = ++this.#requests;
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#timer = null;
      void this.#ask(until, receive, () => request === this.#requests);
    }, DELAY_MS);
  }

  dispose(): void {
    this.#requests++;
    if (this.#timer !== null) clearTimeout(this.#timer);
  }

  async #ask(until: number, receive: TrailReceiver, isNewest: () => boolean): Promise<void> {
    if (!this.#client.isLive) return;
    try {
      const answer = await this.#client.request({ do: "trails", until, bodies: [] });
      if (answer.is === "trails" && isNewest()) receive(answer.trails, until);
    } catch (error) {
      // Without them the page shows the trails that it has seen itself.
      if (!(error instanceof RequestError)) throw error;
    }
  }
}
