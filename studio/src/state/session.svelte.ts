/** One open run: the server's data of it, and the page's settings for it. */

import { Credit } from "../credit";
import { decodeFrame, FrameError, type Frame } from "../decode";
import { linksOf, nodeOf, type Link } from "../fleet/links";
import { CONNECTION_LOST, RequestError, makeProblem } from "../connection";
import { initialSpeed, SPEEDS, bodyKey } from "../format";
import type {
  ReplyBody,
  Method,
  BodyTable,
  RunEvent,
  Inspection,
  Problem,
  Scene,
  Speed,
  SessionStatus,
  OpenTarget,
  BodyId,
} from "../protocol";
import { Bodies } from "./bodies";
import { Events } from "./events.svelte";
import { Metrics } from "./metrics.svelte";
import { DroppedFrames } from "./dropped-frames";
import { cyclesBack_per_s, Rewind } from "./rewind.svelte";
import { Seeker } from "./seeker";
import { Waiters } from "./waiters";

type DistributiveOmit<T, K extends PropertyKey> = T extends unknown ? Omit<T, K> : never;
/** A method of a session, which adds its own number. */
type SessionCall = DistributiveOmit<Extract<Method, { session: number }>, "session">;

/** What a session needs from the page: requests and a sink of problems. */
export interface SessionHost {
  request(call: Method): Promise<ReplyBody>;
  onProblem(problem: Problem): void;
}

export type TrailMode = "none" | "selected" | "all";

/** Minimum time between two inspections of the selected body. */
const MIN_INSPECT_INTERVAL_MS = 200;

const SESSION_NOT_OPEN = makeProblem("session", "it is not open on the server", "wait until the page has reconnected");

/** Delay before credit is granted again for frames that could not be shown. */
const CREDIT_RETRY_DELAY_MS = 1000;

let keys = 0;

export class Session {
  /** The page's own number, which stays when the server assigns another id. */
  readonly key = ++keys;
  readonly target: OpenTarget;
  readonly events = new Events();
  readonly metrics = new Metrics();
  id = $state(0);
  scene = $state.raw<Scene>() as Scene;
  status = $state.raw<SessionStatus>() as SessionStatus;
  bodies = $state.raw<Bodies | null>(null);
  /** Its playback speed. */
  speed = $state.raw<Speed>({ times: 1 });
  /** Cycle, time and count of dropped frames of the shown frame. */
  displayed = $state.raw({ cycle: 0, time_s: 0, leftOut: 0 });
  selected = $state.raw<BodyId | null>(null);
  inspection = $state.raw<Inspection | null>(null);
  inspectProblem = $state.raw<Problem | null>(null);
  ended = $state.raw<Problem | null>(null);
  trails = $state<TrailMode>("selected");
  widthIsTrue = $state(false);
  eventKinds = $state.raw<ReadonlySet<string>>(new Set());
  /** The text that this run was started with instead of the file's. */
  text = $state.raw<string | null>(null);
  /** Whether its text was changed and not saved. */
  isUnsaved = $state(false);
  /** Cycle under the pointer in the timeline or a chart. */
  cursor = $state<number | null>(null);
  /** Counts starts, so that views reset. */
  starts = $state(0);
  /** The newest frame. */
  frame: Frame | null = null;
  /** Whether the newest frame results from a seek and does not just follow the previous one. */
  isAfterSeek = false;
  readonly credit: Credit;
  readonly #host: SessionHost;
  readonly #framesWithoutTable = new Map<number, Frame>();
  readonly #frameListeners = new Set<() => void>();
  #inspectTimer: ReturnType<typeof setTimeout> | null = null;
  #inspectedAt_ms = 0;
  #isInspecting = false;
  readonly #rewind = new Rewind();
  readonly #seeker = new Seeker((cycle) => this.#seekNow(cycle));
  /** The last step in progress. */
  #pendingStep: { target: number } | null = null;
  readonly #dropped = new DroppedFrames();
  /** Counts the page's commands: a seek abandoned for a newer command is no problem. */
  #commands = 0;
  /** Promises waiting for a status or a frame. */
  readonly #waiters = new Waiters();
  #creditTimer: ReturnType<typeof setTimeout> | null = null;
  /** The state when the connection was lost, until it is restored. */
  #resumeState: { cycle: number; isPlaying: boolean; seed: number | null } | null = null;

  constructor(target: OpenTarget, line: SessionHost) {
    this.target = target;
    this.#host = line;
    this.credit = new Credit((frames) => this.sendQuietly({ do: "credit", frames }));
  }

  /** The server has opened it (again). */
  onOpened(answer: Extract<ReplyBody, { is: "opened" }>): void {
    this.id = answer.session;
    if (this.starts === 0) this.speed = { times: initialSpeed(answer.scene.cycle_s) };
    this.#reset(answer);
    this.credit.reset();
    this.credit.refill();
    this.#selectScans();
  }

  /** The connection was lost; session ids belong to the server, and a new one assigns them anew. */
  onConnectionLost(): void {
    this.id = 0;
    this.#rewind.stop();
    this.#waiters.cancelAll();
    const { cycle } = this.displayed;
    // Lost again while resuming: the state before the first loss is still the one to restore.
    this.#resumeState ??= { cycle, isPlaying: this.isPlaying, seed: this.#ownSeed };
  }

  /** Seeks to the cycle where it was, once reopened, and plays if it was playing. Returns the cycle. */
  async resume(): Promise<number> {
    const { cycle, isPlaying, seed } = this.#resumeState ?? { cycle: 0, isPlaying: false, seed: null };
    const { id } = this;
    if (this.isFleet) {
      this.#resumeState = null;
      return this.displayed.cycle;
    }
    if (this.text !== null) await this.restart(seed, this.text);
    if (cycle > 0) await this.#seeker.seekTo(cycle);
    if (id !== this.id) return cycle;
    this.#resumeState = null;
    if (isPlaying) this.play();
    return cycle;
  }

  #reset(answer: Extract<ReplyBody, { is: "opened" }>): void {
    this.scene = answer.scene;
    this.status = answer.status;
    this.ended = null;
    this.events.clear();
    this.metrics.clear();
    this.inspection = null;
    this.#dropped.reset();
    this.#seeker.onRestart();
    this.starts++;
  }

  /** Returns whether it is a fleet that runs elsewhere: it is watched and not controlled. */
  get isFleet(): boolean {
    return this.target.kind === "fleet";
  }

  /** The seed, if a JavaScript number can hold it; null for a recording, which has its own. */
  get seed(): number | null {
    return this.#resumeState ? this.#resumeState.seed : this.#ownSeed;
  }

  get #ownSeed(): number | null {
    if (this.target.kind === "recording" || this.isFleet) return null;
    const seed = Number(this.status.seed);
    return this.status.seed !== "" && Number.isSafeInteger(seed) ? seed : null;
  }

  get isPlaying(): boolean {
    return this.status.state === "playing";
  }

  /** Returns whether it plays forward or backward. */
  get isMoving(): boolean {
    return this.isPlaying || this.#rewind.isOn;
  }

  get isRewinding(): boolean {
    return this.#rewind.isOn;
  }

  /** The last cycle of the timeline; grows where no end is planned. */
  get lastCycle(): number {
    const planned = this.status.cycles_planned;
    return Number.isFinite(planned) && planned !== null && planned > 0 ? planned : Math.max(100, this.status.cycle);
  }

  /** Pairs that hear each other in a fleet, by the indices of bodies; of the selected agent alone where one is. */
  get links(): Link[] {
    const { bodies, selected } = this;
    const { fleet } = this.status;
    if (!fleet || !bodies) return [];
    const bodyOf = new Map(fleet.nodes.map((node) => [node.agent, bodies.find(node.body)]));
    const index = (agent: number): number | undefined => bodyOf.get(agent);
    // A body that is no agent, such as an obstacle, has no links: all links stay visible.
    const chosen = selected ? nodeOf(fleet, selected) : undefined;
    return linksOf(fleet, chosen?.agent ?? null).flatMap(({ from, to, isMutual }) => {
      const [a, b] = [index(from), index(to)];
      return a === undefined || b === undefined ? [] : [{ from: a, to: b, isMutual }];
    });
  }

  subscribe(onFrame: () => void): () => void {
    this.#frameListeners.add(onFrame);
    return () => this.#frameListeners.delete(onFrame);
  }

  /** Called regularly: a hidden session gets few frames, so that it is current when it is shown. */
  grantHidden(): void {
    if (!this.#isWatched && this.id !== 0 && !this.ended) this.credit.refill();
  }

  get #isWatched(): boolean {
    return this.#frameListeners.size > 0 && !globalThis.document?.hidden;
  }

  onBodyTable(table: BodyTable): void {
    this.bodies = new Bodies(table);
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
      this.#host.onProblem(makeProblem("frame", error.message, "reload the page; if it persists, report it"));
      this.#retryCredit();
    }
  }

  /** A frame that cannot be shown is never drawn, so its credit must be granted again or the view would freeze. */
  #retryCredit(): void {
    this.#creditTimer ??= setTimeout(() => {
      this.#creditTimer = null;
      if (this.id !== 0 && !this.ended) this.credit.refill();
    }, CREDIT_RETRY_DELAY_MS);
  }

  #show(frame: Frame): void {
    if (frame.bodies !== this.bodies?.count || frame.lineStarts.length !== this.bodies.lines.length + 1) {
      this.#host.onProblem(makeProblem("frame", "a frame does not match its body table", "reload the page"));
      this.#retryCredit();
      return;
    }
    this.frame = frame;
    this.isAfterSeek = this.#seeker.onFrame();
    this.displayed = {
      cycle: frame.cycle,
      time_s: frame.time_s,
      leftOut: this.#dropped.count(frame.leftOut, this.#isWatched),
    };
    if (frame.text.events.length > 0) this.events.add(frame.text.events);
    for (const send of this.#frameListeners) send();
    this.#waiters.check();
    this.#scheduleInspection();
  }

  onStatus(status: SessionStatus): void {
    this.status = status;
    this.#waiters.check();
  }

  /**
   * Seeks to a cycle; returns the digest of the state there, and the cycle, which is lower where the run ends earlier.
   * A recording that is shown from its tables has no digest.
   */
  async digestAt(cycle: number): Promise<{ cycle: number; digest: string | null } | null> {
    this.#rewind.stop();
    if (!(await this.#seeker.seekTo(cycle))) return null;
    return this.#waiters.waitFor(() => {
      const { state, digest, cycle: at } = this.status;
      const isThere = (state === "paused" && at === cycle) || (state === "over" && at <= cycle);
      return isThere ? { cycle: at, digest } : null;
    });
  }

  /** The frame of the run's current cycle, once it arrives. */
  frameAt(cycle: number): Promise<Frame | null> {
    if (this.id === 0 || this.ended) return Promise.resolve(null);
    return this.#waiters.waitFor(() => (this.frame?.cycle === cycle ? this.frame : null));
  }

  onEnded(problem: Problem): void {
    this.ended = problem;
    this.status = { ...this.status, state: "failed" };
    this.#rewind.stop();
    this.#waiters.cancelAll();
  }

  /** Fetches events and samples; called regularly while the session is shown. */
  refresh(withMetrics: boolean): void {
    if (this.ended) return;
    const cycle = 1 + (this.scene.is_recording ? this.lastCycle : Math.max(this.status.cycle, this.displayed.cycle));
    const ignore = (): void => undefined;
    this.events
      .fetch(cycle, (from, until, skip, limit) => this.#request({ do: "events", from, until, skip, limit }))
      .catch(ignore);
    if (withMetrics && !this.isFleet)
      this.metrics.fetch((from) => this.#request({ do: "metrics", from })).catch(ignore);
  }

  // Commands of the page.

  play(): void {
    this.#onCommand();
    void this.send({ do: "play", speed: this.speed });
  }

  pause(): void {
    this.#onCommand();
    void this.send({ do: "pause" });
  }

  /** Plays backwards. */
  rewind(): void {
    this.#onCommand();
    const { cycle } = this.displayed;
    const times = this.speed === "fastest" ? this.speed : this.speed.times;
    void this.#rewind.start(cycle, cyclesBack_per_s(times, this.scene.cycle_s, cycle), (to) => this.#seeker.seekTo(to));
  }

  step(cycles: number): void {
    const from = this.#seeker.target ?? this.#pendingStep?.target ?? this.displayed.cycle;
    if (cycles < 0 || this.#seeker.target !== null) return this.seek(from + cycles);
    this.#onCommand();
    void this.#stepNow(from + cycles, cycles);
  }

  /** Steps requested faster than they complete add up, here and on the server. */
  async #stepNow(target: number, cycles: number): Promise<void> {
    const orders = this.#commands;
    const step = (this.#pendingStep = { target });
    try {
      await this.#request({ do: "step", cycles });
    } catch (error) {
      if (orders === this.#commands) this.#report(error);
    } finally {
      if (this.#pendingStep === step) this.#pendingStep = null;
    }
  }

  /** The page has closed it: pending requests no longer matter. */
  dispose(): void {
    this.sendQuietly({ do: "close" });
    this.#onCommand();
    this.id = 0;
    this.#waiters.cancelAll();
    for (const timer of [this.#inspectTimer, this.#creditTimer]) if (timer !== null) clearTimeout(timer);
  }

  /** Registers a new command, which ends automatic playback backwards. */
  #onCommand(): void {
    this.#commands++;
    this.#rewind.stop();
  }

  setSpeed(speed: Speed): void {
    const { isPlaying, isRewinding } = this;
    this.speed = speed;
    if (isPlaying) this.play();
    else if (isRewinding) this.rewind();
  }

  /** Switches to the next or previous standard speed. */
  changeSpeed(direction: 1 | -1): void {
    const now = this.speed === "fastest" ? Infinity : this.speed.times;
    const sizes = SPEEDS.map((speed) => (speed === "fastest" ? Infinity : speed));
    const wanted = direction > 0 ? sizes.find((s) => s > now) : sizes.findLast((s) => s < now);
    if (wanted !== undefined) this.setSpeed(wanted === Infinity ? "fastest" : { times: wanted });
  }

  /** Seeks to a cycle; during a seek only the latest request is kept. */
  seek(cycle: number): void {
    if (this.isFleet) return;
    this.#onCommand();
    void this.#seeker.seekTo(Math.round(Math.min(Math.max(0, cycle), this.lastCycle)));
  }

  async #seekNow(cycle: number): Promise<boolean> {
    const orders = this.#commands;
    try {
      await this.#request({ do: "seek", cycle });
      return true;
    } catch (error) {
      if (orders === this.#commands) this.#report(error);
      return false;
    }
  }

  /** Restarts the run. Returns whether the server accepted. */
  async restart(seed: number | null, text: string | null): Promise<boolean> {
    this.#onCommand();
    const answer = await this.send({ do: "restart", seed, text });
    if (answer === null) return false;
    if (text !== null) this.text = text;
    if (answer.is === "opened") this.#reset(answer);
    else this.#reset({ is: "opened", session: this.id, scene: this.scene, status: { ...this.status, cycle: 0 } });
    this.credit.refill();
    this.#selectScans();
    return true;
  }

  select(body: BodyId | null): void {
    const same = body && this.selected && bodyKey(body) === bodyKey(this.selected);
    if (same) return;
    this.selected = body;
    this.inspection = null;
    this.inspectProblem = null;
    this.#selectScans();
    this.#inspectedAt_ms = 0;
    this.#scheduleInspection();
  }

  /** Seeks to an event, and selects its agent. */
  visit(event: RunEvent): void {
    const agent = [event.body, event.other].find((body) => {
      const index = body ? this.bodies?.find(body) : undefined;
      return index !== undefined && this.bodies?.table.is_agent[index];
    });
    if (agent) this.select(agent);
    this.seek(event.cycle);
  }

  /** Jumps to the next or previous visible event. */
  jump(direction: 1 | -1): void {
    const kinds = this.eventKinds;
    const event = this.events.neighbor(this.displayed.cycle, direction, (e) => !kinds.has(e.kind));
    if (event) this.visit(event);
  }

  source(): Promise<ReplyBody> {
    return this.#request({ do: "source" });
  }

  /** The folder of the recording, if it is one: only folders have reports. */
  get folder(): string | null {
    const { target } = this;
    return target.kind === "recording" && !/\.mcap$/i.test(target.path) ? target.path : null;
  }

  /** The names of the recorded tables. */
  async tables(): Promise<string[]> {
    const answer = await this.send({ do: "tables" });
    return answer?.is === "tables" ? answer.names : [];
  }

  check(text: string): Promise<ReplyBody> {
    return this.#request({ do: "check", text });
  }

  /** Sends a request of the editor. */
  request(call: Method): Promise<ReplyBody> {
    return this.id === 0 ? Promise.reject(new RequestError(SESSION_NOT_OPEN)) : this.#host.request(call);
  }

  reportProblem(problem: Problem): void {
    this.#host.onProblem(problem);
  }

  /** Sends a request and reports its problem, if there is one. */
  async send(call: SessionCall): Promise<ReplyBody | null> {
    try {
      return await this.#request(call);
    } catch (error) {
      this.#report(error);
      return null;
    }
  }

  /** Reports a problem, except for a lost connection, which one banner reports for all requests. */
  #report(error: unknown): void {
    if (!(error instanceof RequestError)) throw error;
    if (error.problem !== CONNECTION_LOST && error.problem !== SESSION_NOT_OPEN) this.#host.onProblem(error.problem);
  }

  /** Sends a request whose failure is ignored. */
  sendQuietly(call: SessionCall): void {
    this.#request(call).catch(() => undefined);
  }

  #request(call: SessionCall): Promise<ReplyBody> {
    // Between two connections the session has no id on the server.
    if (this.id === 0) return Promise.reject(new RequestError(SESSION_NOT_OPEN));
    return this.#host.request({ ...call, session: this.id } as Method);
  }

  #selectScans(): void {
    this.sendQuietly({ do: "select-scans", bodies: this.selected ? [this.selected] : [] });
  }

  #scheduleInspection(): void {
    if (!this.selected || this.isFleet || this.#isInspecting || this.#inspectTimer !== null) return;
    const wait_ms = Math.max(0, this.#inspectedAt_ms + MIN_INSPECT_INTERVAL_MS - performance.now());
    this.#inspectTimer = setTimeout(() => {
      this.#inspectTimer = null;
      void this.#inspect();
    }, wait_ms);
  }

  async #inspect(): Promise<void> {
    const body = this.selected;
    const frame = this.frame;
    if (!body) return;
    this.#isInspecting = true;
    this.#inspectedAt_ms = performance.now();
    try {
      const answer = await this.#request({ do: "inspect", body });
      if (this.selected === body && answer.is === "inspection") {
        this.inspection = answer;
        this.inspectProblem = null;
      }
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (this.selected === body) this.inspectProblem = error.problem;
    } finally {
      this.#isInspecting = false;
      for (const listener of this.#frameListeners) listener();
      if (this.selected !== body || this.frame !== frame) this.#scheduleInspection();
    }
  }
}
