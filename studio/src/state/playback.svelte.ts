/** Playback of a session: plays forward and backward, steps and seeks. */

import { SPEEDS } from "../format";
import type { Speed } from "../protocol";
import type { Frames } from "./frames.svelte";
import { cyclesBack_per_s, Rewind } from "./rewind.svelte";
import type { RunState } from "./run-state.svelte";
import { Seeker } from "./seeker";
import type { SessionClient } from "./session-client.svelte";
import { Waiters } from "./waiters";

/** The digest of the state after a cycle; null for a recording that is shown from its tables. */
export interface CycleDigest {
  cycle: number;
  digest: string | null;
}

export class Playback {
  speed = $state.raw<Speed>({ times: 1 });
  readonly #client: SessionClient;
  readonly #run: RunState;
  readonly #frames: Frames;
  readonly #canSeek: boolean;
  readonly #rewind = new Rewind();
  readonly #seeker = new Seeker((cycle) => this.#requestSeek(cycle));
  /** The last step in progress. */
  #pendingStep: { target: number } | null = null;
  /** Counts the page's commands: a seek abandoned for a newer command is no problem. */
  #commands = 0;
  /** Promises waiting for a status. */
  readonly #waiters = new Waiters();

  /** `canSeek`: a fleet runs elsewhere, and is watched and not controlled. */
  constructor(client: SessionClient, run: RunState, frames: Frames, canSeek: boolean) {
    this.#client = client;
    this.#run = run;
    this.#frames = frames;
    this.#canSeek = canSeek;
  }

  /** Returns whether it plays forward or backward. */
  get isMoving(): boolean {
    return this.#run.isPlaying || this.#rewind.isOn;
  }

  get isRewinding(): boolean {
    return this.#rewind.isOn;
  }

  play(): void {
    this.interrupt();
    void this.#client.send({ do: "play", speed: this.speed });
  }

  pause(): void {
    this.interrupt();
    void this.#client.send({ do: "pause" });
  }

  /** Plays backwards. */
  rewind(): void {
    this.interrupt();
    const { cycle } = this.#frames;
    const times = this.speed === "fastest" ? this.speed : this.speed.times;
    const cycles_per_s = cyclesBack_per_s(times, this.#run.scene.cycle_s, cycle);
    void this.#rewind.start(cycle, cycles_per_s, (to) => this.#seeker.seekTo(to));
  }

  step(cycles: number): void {
    const from = this.#seeker.target ?? this.#pendingStep?.target ?? this.#frames.cycle;
    // The server only steps forward; and a step during a seek counts from the seek's target.
    if (cycles < 0 || this.#seeker.target !== null) return this.seek(from + cycles);
    this.interrupt();
    void this.#requestStep(from + cycles, cycles);
  }

  /** Seeks to a cycle; during a seek only the latest request is kept. */
  seek(cycle: number): void {
    if (!this.#canSeek) return;
    this.interrupt();
    void this.seekTo(Math.round(Math.min(Math.max(0, cycle), this.#run.lastCycle)));
  }

  /** Seeks to a cycle as part of another command. Returns whether it was reached. */
  seekTo(cycle: number): Promise<boolean> {
    return this.#seeker.seekTo(cycle);
  }

  /**
   * Seeks to a cycle; returns the digest of the state there, and the cycle, which is lower where the run ends earlier.
   * Null if the seek failed or the session ended.
   */
  async digestAt(cycle: number): Promise<CycleDigest | null> {
    this.#rewind.stop();
    if (!(await this.#seeker.seekTo(cycle))) return null;
    return this.#waiters.waitFor(() => {
      const { state, digest, cycle: at } = this.#run.status;
      // A replay may have only some of the cycles, and goes to the last one before.
      const isThere = at === cycle || (this.#client.isReplay && at <= cycle);
      const isReached = (state === "paused" && isThere) || (state === "over" && at <= cycle);
      return isReached ? { cycle: at, digest } : null;
    });
  }

  setSpeed(speed: Speed): void {
    const isPlaying = this.#run.isPlaying;
    const isRewinding = this.isRewinding;
    this.speed = speed;
    if (isPlaying) this.play();
    else if (isRewinding) this.rewind();
  }

  /** Switches to the next or previous standard speed. */
  changeSpeed(direction: 1 | -1): void {
    const now = this.speed === "fastest" ? Infinity : this.speed.times;
    const sizes = SPEEDS.map((speed) => (speed === "fastest" ? Infinity : speed));
    const next = direction > 0 ? sizes.find((size) => size > now) : sizes.findLast((size) => size < now);
    if (next !== undefined) this.setSpeed(next === Infinity ? "fastest" : { times: next });
  }

  /** Registers a new command, which ends automatic playback backwards. */
  interrupt(): void {
    this.#commands++;
    this.#rewind.stop();
  }

  /** The server has started the run (again). */
  onStart(): void {
    this.#seeker.onRestart();
  }

  /** The run's status has changed. */
  onStatus(): void {
    this.#waiters.check();
  }

  /** Registers a frame; returns whether it results from a seek and does not just follow the previous one. */
  onFrame(): boolean {
    return this.#seeker.onFrame();
  }

  /** Stops playing backwards and ends all waits, as the server cannot reply. */
  cancel(): void {
    this.#rewind.stop();
    this.#waiters.cancelAll();
  }

  /** Steps requested faster than they complete add up, here and on the server. */
  async #requestStep(target: number, cycles: number): Promise<void> {
    const command = this.#commands;
    const step = (this.#pendingStep = { target });
    try {
      await this.#client.request({ do: "step", cycles });
    } catch (error) {
      if (command === this.#commands) this.#client.reportError(error);
    } finally {
      if (this.#pendingStep === step) this.#pendingStep = null;
    }
  }

  async #requestSeek(cycle: number): Promise<boolean> {
    const command = this.#commands;
    try {
      await this.#client.request({ do: "seek", cycle });
      return true;
    } catch (error) {
      // The server refuses a seek that a newer one has replaced.
      if (command === this.#commands && this.#seeker.isCurrent(cycle)) this.#client.reportError(error);
      return false;
    }
  }
}
