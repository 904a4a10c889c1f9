/** The selected body of a session, and the server's inspection of it. */

import { RequestError } from "../connection";
import { bodyKey } from "../format";
import type { BodyId, Inspection, Problem } from "../protocol";
import type { Frames } from "./frames.svelte";
import type { SessionClient } from "./session-client.svelte";

/** Minimum time between two inspections: each costs the server a trial of the body's next action. */
const MIN_INSPECT_INTERVAL_MS = 200;

export class Selection {
  body = $state.raw<BodyId | null>(null);
  inspection = $state.raw<Inspection | null>(null);
  problem = $state.raw<Problem | null>(null);
  readonly #client: SessionClient;
  readonly #frames: Frames;
  readonly #canInspect: boolean;
  #timer: ReturnType<typeof setTimeout> | null = null;
  #inspectedAt_ms = -Infinity;
  #isInspecting = false;

  /** `canInspect`: a fleet, whose agents run elsewhere, shows nodes instead of inspections. */
  constructor(client: SessionClient, frames: Frames, canInspect: boolean) {
    this.#client = client;
    this.#frames = frames;
    this.#canInspect = canInspect;
  }

  select(body: BodyId | null): void {
    const isSame = body && this.body && bodyKey(body) === bodyKey(this.body);
    if (isSame) return;
    this.body = body;
    this.inspection = null;
    this.problem = null;
    this.selectScans();
    // A new selection is inspected at once.
    this.#inspectedAt_ms = -Infinity;
    this.scheduleInspection();
  }

  /** The server has started the run (again): the last inspection is of another state. */
  onStart(): void {
    this.inspection = null;
  }

  /** Has the server send the scans of the selected body with its frames; a new session on the server sends none. */
  selectScans(): void {
    this.#client.sendQuietly({ do: "select-scans", bodies: this.body ? [this.body] : [] });
  }

  /** Inspects the selected body, at most once per interval. */
  scheduleInspection(): void {
    if (!this.body || !this.#canInspect || this.#isInspecting || this.#timer !== null) return;
    const wait_ms = Math.max(0, this.#inspectedAt_ms + MIN_INSPECT_INTERVAL_MS - performance.now());
    this.#timer = setTimeout(() => {
      this.#timer = null;
      void this.#inspect();
    }, wait_ms);
  }

  dispose(): void {
    if (this.#timer !== null) clearTimeout(this.#timer);
  }

  async #inspect(): Promise<void> {
    const body = this.body;
    const frame = this.#frames.newest;
    if (!body) return;
    this.#isInspecting = true;
    this.#inspectedAt_ms = performance.now();
    try {
      const answer = await this.#client.request({ do: "inspect", body });
      if (this.body === body && answer.is === "inspection") {
        this.inspection = answer;
        this.problem = null;
      }
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (this.body === body) this.problem = error.problem;
    } finally {
      this.#isInspecting = false;
      // The viewport draws marks of the inspection over the frame.
      this.#frames.notify();
      // Frames that arrived during the request could not schedule one.
      if (this.body !== body || this.#frames.newest !== frame) this.scheduleInspection();
    }
  }
}
