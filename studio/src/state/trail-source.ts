/** Asks for trails that the page was not shown: after a seek, and when a run is opened that is not at its start. */

import { RequestError } from "../connection";
import type { BodyId, BodyTrail } from "../protocol";
import type { SessionClient } from "./session-client.svelte";

/** Time without another seek before trails are asked for: while somebody scrubs, only the last cycle matters. */
const DELAY_MS = 60;

/** The trails of some bodies up to a cycle; of all agents where none is named. */
export interface TrailRequest {
  until: number;
  bodies: readonly BodyId[];
}

/** Receives the trails of a request. */
export type TrailReceiver = (trails: readonly BodyTrail[], request: TrailRequest) => void;

export class TrailSource {
  readonly #client: SessionClient;
  #timer: ReturnType<typeof setTimeout> | null = null;
  #requests = 0;
  /** Asks for what is due once the timer has run down. */
  #due: (() => void) | null = null;
  /** The last request that was sent, until it is answered. */
  #pending: Promise<void> = Promise.resolve();

  constructor(client: SessionClient) {
    this.#client = client;
  }

  /** Asks for trails, unless another request follows at once. */
  request(wanted: TrailRequest, receive: TrailReceiver): void {
    const request = ++this.#requests;
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#due = () => {
      this.#timer = this.#due = null;
      this.#pending = this.#ask(wanted, receive, () => request === this.#requests);
    };
    this.#timer = setTimeout(this.#due, DELAY_MS);
  }

  /** Asks at once for what is wanted, and waits for the reply. */
  async settle(): Promise<void> {
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#due?.();
    await this.#pending;
  }

  dispose(): void {
    this.#requests++;
    this.#due = null;
    if (this.#timer !== null) clearTimeout(this.#timer);
  }

  async #ask(wanted: TrailRequest, receive: TrailReceiver, isNewest: () => boolean): Promise<void> {
    if (!this.#client.isLive) return;
    try {
      const answer = await this.#client.request({ do: "trails", until: wanted.until, bodies: [...wanted.bodies] });
      if (answer.is === "trails" && isNewest()) receive(answer.trails, wanted);
    } catch (error) {
      // Without them the page shows the trails that it has seen itself.
      if (!(error instanceof RequestError)) throw error;
    }
  }
}
