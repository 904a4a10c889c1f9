/** The frames of a session: decodes them, pairs each with its body table, and grants the server credit for more. */

import { Credit } from "../credit";
import { makeProblem } from "../connection";
import { decodeFrame, FrameError, type Frame } from "../decode";
import type { BodyTable, Scene } from "../protocol";
import { Bodies } from "./bodies";
import { DroppedFrames } from "./dropped-frames";
import type { SessionClient } from "./session-client.svelte";
import { Waiters } from "./waiters";

/** Delay before credit is granted again for frames that could not be shown. */
const CREDIT_RETRY_DELAY_MS = 1000;

/**
 * Minimum time between two changes of the texts around the view while frames follow each other: nobody reads more, and each
 * makes the browser lay out and draw parts of the page anew, which costs as much as the view's picture.
 */
const TEXT_INTERVAL_MS = 100;

/** What the frames of a session need from its other parts. */
export interface FrameHooks {
  /** Returns whether the frame that has just arrived results from a seek. */
  isAfterSeek(): boolean;
  /** Called once the newest frame is known to all listeners. */
  onShown(frame: Frame): void;
}

export class Frames {
  bodies = $state.raw<Bodies | null>(null);
  /** Cycle, time and count of dropped frames of the shown frame, for texts; up to a moment old. */
  displayed = $state.raw({ cycle: 0, time_s: 0, leftOut: 0 });
  #newestDisplayed = this.displayed;
  #textTimer: ReturnType<typeof setTimeout> | null = null;
  /** The newest frame. */
  newest: Frame | null = null;
  /** Whether the newest frame results from a seek and does not just follow the previous one. */
  isAfterSeek = false;
  readonly credit: Credit;
  readonly #client: SessionClient;
  readonly #hooks: FrameHooks;
  /** Frames that arrived before their body table, by the table's id. */
  readonly #framesWithoutTable = new Map<number, Frame>();
  readonly #listeners = new Set<() => void>();
  readonly #dropped = new DroppedFrames();
  /** Promises waiting for a frame. */
  readonly #waiters = new Waiters();
  #creditTimer: ReturnType<typeof setTimeout> | null = null;

  constructor(client: SessionClient, hooks: FrameHooks) {
    this.#client = client;
    this.#hooks = hooks;
    this.credit = new Credit((frames) => client.sendQuietly({ do: "credit", frames }));
  }

  /** The server has started the run (again), and counts dropped frames anew. */
  onStart(): void {
    this.#dropped.reset();
  }

  /** Calls back at each new frame until the returned function is called. */
  subscribe(onFrame: () => void): () => void {
    this.#listeners.add(onFrame);
    return () => this.#listeners.delete(onFrame);
  }

  /** Has all listeners draw the newest frame again. */
  notify(): void {
    for (const listener of this.#listeners) listener();
  }

  /** Called regularly: a hidden session gets few frames, so that it is current when it is shown. */
  grantHidden(): void {
    if (!this.#isWatched && this.#client.isLive) this.credit.refill();
  }

  get #isWatched(): boolean {
    return this.#listeners.size > 0 && !globalThis.document?.hidden;
  }

  onBodyTable(table: BodyTable, scene: Pick<Scene, "groups" | "names">): void {
    this.bodies = new Bodies(table, scene.groups, scene.names);
    const frame = this.#framesWithoutTable.get(table.id);
    this.#framesWithoutTable.clear();
    if (frame) this.#show(frame);
  }

  onFrame(bytes: ArrayBuffer): void {
    this.credit.onFrame();
    try {
      const frame = decodeFrame(bytes);
      if (frame.tableId === this.bodies?.table.id) this.#show(frame);
      else this.#framesWithoutTable.set(frame.tableId, frame);
    } catch (error) {
      if (!(error instanceof FrameError)) throw error;
      this.#client.reportProblem(makeProblem("frame", error.message, "reload the page; if it persists, report it"));
      this.#retryCredit();
    }
  }

  /** The frame of a cycle, once it arrives; null if the session ends first. */
  waitForCycle(cycle: number): Promise<Frame | null> {
    if (!this.#client.isLive) return Promise.resolve(null);
    return this.#waiters.waitFor(() => (this.newest?.cycle === cycle ? this.newest : null));
  }

  /** Ends all waits, as no frame will arrive. */
  cancelWaits(): void {
    this.#waiters.cancelAll();
  }

  dispose(): void {
    this.cancelWaits();
    if (this.#creditTimer !== null) clearTimeout(this.#creditTimer);
    if (this.#textTimer !== null) clearTimeout(this.#textTimer);
  }

  /** The cycle of the newest frame. */
  get cycle(): number {
    return this.#newestDisplayed.cycle;
  }

  /** Shows the newest numbers: at once after a seek or a pause between frames, else once the last ones could be read. */
  #display(): void {
    if (this.#textTimer !== null && !this.isAfterSeek) return;
    if (this.#textTimer !== null) clearTimeout(this.#textTimer);
    this.displayed = this.#newestDisplayed;
    this.#textTimer = setTimeout(() => {
      this.#textTimer = null;
      if (this.displayed !== this.#newestDisplayed) this.#display();
    }, TEXT_INTERVAL_MS);
  }

  /** A frame that cannot be shown is never drawn, so its credit must be granted again or the view would freeze. */
  #retryCredit(): void {
    this.#creditTimer ??= setTimeout(() => {
      this.#creditTimer = null;
      if (this.#client.isLive) this.credit.refill();
    }, CREDIT_RETRY_DELAY_MS);
  }

  #show(frame: Frame): void {
    if (frame.bodies !== this.bodies?.count || frame.lineStarts.length !== this.bodies.lines.length + 1) {
      this.#client.reportProblem(makeProblem("frame", "a frame does not match its body table", "reload the page"));
      this.#retryCredit();
      return;
    }
    this.newest = frame;
    this.isAfterSeek = this.#hooks.isAfterSeek();
    this.#newestDisplayed = {
      cycle: frame.cycle,
      time_s: frame.time_s,
      leftOut: this.#dropped.count(frame.leftOut, this.#isWatched),
    };
    this.#display();
    this.notify();
    this.#waiters.check();
    this.#hooks.onShown(frame);
  }
}
