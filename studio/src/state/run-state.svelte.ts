/** The run of a session as the server describes it: scene, status, and the text that it was started with. */

import type { Scene, SessionStatus } from "../protocol";

/** Minimum length of the timeline of a run without a planned end, which would have none at the start. */
const MIN_TIMELINE_CYCLES = 100;

export class RunState {
  scene = $state.raw<Scene>() as Scene;
  status = $state.raw<SessionStatus>() as SessionStatus;
  /** The text that this run was started with instead of the file's. */
  text = $state.raw<string | null>(null);
  /** Whether its text was changed and not saved. */
  isUnsaved = $state(false);
  /** Counts starts, so that views reset. */
  starts = $state(0);

  /** The server has started it (again). */
  onStart(scene: Scene, status: SessionStatus): void {
    this.scene = scene;
    this.status = status;
    this.starts++;
  }

  /** The session has ended on the server. */
  onEnded(): void {
    this.status = { ...this.status, state: "failed" };
  }

  /** The seed, if a JavaScript number can hold it. */
  get seed(): number | null {
    const seed = Number(this.status.seed);
    return this.status.seed !== "" && Number.isSafeInteger(seed) ? seed : null;
  }

  /** Returns whether the server plays it forward. */
  get isPlaying(): boolean {
    return this.status.state === "playing";
  }

  /** The last cycle of the timeline; grows where no end is planned. */
  get lastCycle(): number {
    const planned = this.status.cycles_planned;
    const hasEnd = Number.isFinite(planned) && planned !== null && planned > 0;
    return hasEnd ? planned : Math.max(MIN_TIMELINE_CYCLES, this.status.cycle);
  }
}
