/** One open run: the server's data of it, and the page's choices in it. */

import { Credit } from "../credit";
import { decodeFrame, FrameError, type Frame } from "../decode";
import { linksOf, nodeOf, type Link } from "../fleet/links";
import { LOST, Refused, problemOf } from "../connection";
import { firstSpeed, SPEEDS, whoKey } from "../format";
import type { Answer, Call, Cast, Event, Inspection, Problem, Scene, Speed, Status, Subject, Who } from "../protocol";
import { Bodies } from "./cast";
import { Events } from "./events.svelte";
import { Metrics } from "./metrics.svelte";
import { Missed } from "./missed";
import { cyclesBack_per_s, Rewind } from "./rewind.svelte";
import { Seeker } from "./seeker";
import { Waiting } from "./waiting";

type DistributiveOmit<T, K extends PropertyKey> = T extends unknown ? Omit<T, K> : never;
/** A call to a session, which adds its own number. */
type OwnCall = DistributiveOmit<Extract<Call, { session: number }>, "session">;

/** The session's line to its surroundings. */
export interface Line {
  ask(call: Call): Promise<Answer>;
  problem(problem: Problem): void;
}

export type TrailChoice = "none" | "selected" | "all";

/** Least time between two questions about the selected body while the run goes on. */
const INSPECT_EVERY_MS = 200;

const NO_SESSION = problemOf("session", "it is not open at the server", "wait until the page is connected again");

/** Wait before credit is granted again for frames that could not be shown. */
const REGRANT_AFTER_MS = 1000;

let keys = 0;

export class Session {
  /** The page's own number, which stays when the server gives another. */
  readonly key = ++keys;
  readonly subject: Subject;
  readonly events = new Events();
  readonly metrics = new Metrics();
  id = $state(0);
  scene = $state.raw<Scene>() as Scene;
  status = $state.raw<Status>() as Status;
  bodies = $state.raw<Bodies | null>(null);
  /** Its speed when it plays. */
  speed = $state.raw<Speed>({ times: 1 });
  /** Cycle, time and count of left-out frames of the shown picture. */
  shown = $state.raw({ cycle: 0, time_s: 0, leftOut: 0 });
  selected = $state.raw<Who | null>(null);
  inspection = $state.raw<Inspection | null>(null);
  inspectProblem = $state.raw<Problem | null>(null);
  ended = $state.raw<Problem | null>(null);
  trails = $state<TrailChoice>("selected");
  widthIsTrue = $state(false);
  eventKinds = $state.raw<ReadonlySet<string>>(new Set());
  /** The text that this run was started with instead of the file's. */
  text = $state.raw<string | null>(null);
  /** Whether its text was changed and not saved. */
  isUnsaved = $state(false);
  /** Cycle under the pointer in the timeline or a chart. */
  cursor = $state<number | null>(null);
  /** Counts starts, so that views begin anew. */
  starts = $state(0);
  /** The newest frame. */
  frame: Frame | null = null;
  /** Whether the newest frame was asked for, and does not just follow the one before. */
  isSought = false;
  readonly credit: Credit;
  readonly #line: Line;
  readonly #early = new Map<number, Frame>();
  readonly #onFrame = new Set<() => void>();
  #inspectTimer: ReturnType<typeof setTimeout> | null = null;
  #inspectedAt_ms = 0;
  #isInspecting = false;
  readonly #rewind = new Rewind();
  readonly #seeker = new Seeker((cycle) => this.#seekNow(cycle));
  /** The last step that is under way. */
  #stepping: { goal: number } | null = null;
  readonly #missed = new Missed();
  /** Counts the page's orders to the run: a way that was given up for a newer order is no problem. */
  #orders = 0;
  /** Promises that wait for a state or a frame. */
  readonly #waiting = new Waiting();
  #regrantTimer: ReturnType<typeof setTimeout> | null = null;
  /** The state at which the connection was lost, until it is there again. */
  #kept: { cycle: number; isPlaying: boolean; seed: number | null } | null = null;

  constructor(subject: Subject, line: Line) {
    this.subject = subject;
    this.#line = line;
    this.credit = new Credit((frames) => this.quietly({ do: "credit", frames }));
  }

  /** Notes that the server has opened it (again). */
  opened(answer: Extract<Answer, { is: "opened" }>): void {
    this.id = answer.session;
    if (this.starts === 0) this.speed = { times: firstSpeed(answer.scene.cycle_s) };
    this.#begun(answer);
    this.credit.reset();
    this.credit.drawn();
    this.#look();
  }

  /** Notes that the connection was lost; numbers of sessions are the server's, and a new one counts anew. */
  cutOff(): void {
    this.id = 0;
    this.#rewind.stop();
    this.#waiting.over();
    const { cycle } = this.shown;
    // Lost once more on the way back: where it was in the end is where it was in the beginning.
    this.#kept ??= { cycle, isPlaying: this.isPlaying, seed: this.#ownSeed };
  }

  /** Goes back to where it was, once opened again, and on if it played. Returns the cycle. */
  async resume(): Promise<number> {
    const { cycle, isPlaying, seed } = this.#kept ?? { cycle: 0, isPlaying: false, seed: null };
    const { id } = this;
    if (this.isFleet) {
      this.#kept = null;
      return this.shown.cycle;
    }
    if (this.text !== null) await this.restart(seed, this.text);
    if (cycle > 0) await this.#seeker.to(cycle);
    if (id !== this.id) return cycle;
    this.#kept = null;
    if (isPlaying) this.play();
    return cycle;
  }

  #begun(answer: Extract<Answer, { is: "opened" }>): void {
    this.scene = answer.scene;
    this.status = answer.status;
    this.ended = null;
    this.events.clear();
    this.metrics.clear();
    this.inspection = null;
    this.#missed.reset();
    this.#seeker.jumped();
    this.starts++;
  }

  /** Returns whether it is a fleet that flies elsewhere: it is watched, and nothing is asked of it. */
  get isFleet(): boolean {
    return this.subject.kind === "fleet";
  }

  /** The seed, where a number of the page can hold it; a recording has none but its own. */
  get seed(): number | null {
    return this.#kept ? this.#kept.seed : this.#ownSeed;
  }

  get #ownSeed(): number | null {
    if (this.subject.kind === "recording" || this.isFleet) return null;
    const seed = Number(this.status.seed);
    return this.status.seed !== "" && Number.isSafeInteger(seed) ? seed : null;
  }

  get isPlaying(): boolean {
    return this.status.state === "playing";
  }

  /** Returns whether it goes on or back by itself. */
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
    const bodyOf = new Map(fleet.nodes.map((node) => [node.agent, bodies.find(node.who)]));
    const index = (agent: number): number | undefined => bodyOf.get(agent);
    // A body that is no agent, such as an obstacle, hears no other: all links stay.
    const chosen = selected ? nodeOf(fleet, selected) : undefined;
    return linksOf(fleet, chosen?.agent ?? null).flatMap(({ from, to, isMutual }) => {
      const [a, b] = [index(from), index(to)];
      return a === undefined || b === undefined ? [] : [{ from: a, to: b, isMutual }];
    });
  }

  subscribe(onFrame: () => void): () => void {
    this.#onFrame.add(onFrame);
    return () => this.#onFrame.delete(onFrame);
  }

  /** Called regularly: a session out of sight needs few frames, so that it is ready when it is looked at. */
  grantUnseen(): void {
    if (!this.#isWatched && this.id !== 0 && !this.ended) this.credit.drawn();
  }

  get #isWatched(): boolean {
    return this.#onFrame.size > 0 && !globalThis.document?.hidden;
  }

  takeCast(cast: Cast): void {
    this.bodies = new Bodies(cast);
    const early = this.#early.get(cast.cast);
    this.#early.clear();
    if (early) this.#show(early);
  }

  takeFrame(bytes: ArrayBuffer): void {
    this.credit.arrived();
    try {
      const frame = decodeFrame(bytes);
      if (frame.cast === this.bodies?.cast.cast) this.#show(frame);
      else this.#early.set(frame.cast, frame);
    } catch (error) {
      if (!(error instanceof FrameError)) throw error;
      this.#line.problem(problemOf("frame", error.message, "reload the page; if it stays so, report it"));
      this.#regrantSoon();
    }
  }

  /** Nothing is drawn of a frame that cannot be shown, which would end the credit, and the picture stood still. */
  #regrantSoon(): void {
    this.#regrantTimer ??= setTimeout(() => {
      this.#regrantTimer = null;
      if (this.id !== 0 && !this.ended) this.credit.drawn();
    }, REGRANT_AFTER_MS);
  }

  #show(frame: Frame): void {
    if (frame.bodies !== this.bodies?.count || frame.lineStarts.length !== this.bodies.lines.length + 1) {
      this.#line.problem(problemOf("frame", "a frame does not fit its cast", "reload the page"));
      this.#regrantSoon();
      return;
    }
    this.frame = frame;
    this.isSought = this.#seeker.arrived();
    this.shown = {
      cycle: frame.cycle,
      time_s: frame.time_s,
      leftOut: this.#missed.count(frame.leftOut, this.#isWatched),
    };
    if (frame.text.events.length > 0) this.events.add(frame.text.events);
    for (const tell of this.#onFrame) tell();
    this.#waiting.changed();
    this.#inspectSoon();
  }

  takeStatus(status: Status): void {
    this.status = status;
    this.#waiting.changed();
  }

  /**
   * Goes to a cycle; returns the digest of the state there, and the cycle, which is less where the run is over before.
   * There is no digest of a recording that is shown from its tables.
   */
  async digestAt(cycle: number): Promise<{ cycle: number; digest: string | null } | null> {
    this.#rewind.stop();
    if (!(await this.#seeker.to(cycle))) return null;
    return this.#waiting.for(() => {
      const { state, digest, cycle: at } = this.status;
      const isThere = (state === "paused" && at === cycle) || (state === "over" && at <= cycle);
      return isThere ? { cycle: at, digest } : null;
    });
  }

  /** The frame of a cycle where the run stands, once it has come. */
  frameAt(cycle: number): Promise<Frame | null> {
    if (this.id === 0 || this.ended) return Promise.resolve(null);
    return this.#waiting.for(() => (this.frame?.cycle === cycle ? this.frame : null));
  }

  takeEnd(problem: Problem): void {
    this.ended = problem;
    this.status = { ...this.status, state: "failed" };
    this.#rewind.stop();
    this.#waiting.over();
  }

  /** Fetches events and samples; called regularly while the session is shown. */
  refresh(withMetrics: boolean): void {
    if (this.ended) return;
    const cycle = 1 + (this.scene.is_recording ? this.lastCycle : Math.max(this.status.cycle, this.shown.cycle));
    const quiet = (): void => undefined;
    this.events
      .fetch(cycle, (from, until, skip, most) => this.#ask({ do: "events", from, until, skip, most }))
      .catch(quiet);
    if (withMetrics && !this.isFleet) this.metrics.fetch((from) => this.#ask({ do: "metrics", from })).catch(quiet);
  }

  // The page's orders to the run.

  play(): void {
    this.#order();
    void this.tell({ do: "play", speed: this.speed });
  }

  pause(): void {
    this.#order();
    void this.tell({ do: "pause" });
  }

  /** Plays backwards. */
  rewind(): void {
    this.#order();
    const { cycle } = this.shown;
    const times = this.speed === "fastest" ? this.speed : this.speed.times;
    void this.#rewind.start(cycle, cyclesBack_per_s(times, this.scene.cycle_s, cycle), (to) => this.#seeker.to(to));
  }

  step(cycles: number): void {
    const from = this.#seeker.goal ?? this.#stepping?.goal ?? this.shown.cycle;
    if (cycles < 0 || this.#seeker.goal !== null) return this.seek(from + cycles);
    this.#order();
    void this.#stepNow(from + cycles, cycles);
  }

  /** Steps that follow each other faster than they are gone add up, here and at the server. */
  async #stepNow(goal: number, cycles: number): Promise<void> {
    const orders = this.#orders;
    const step = (this.#stepping = { goal });
    try {
      await this.#ask({ do: "step", cycles });
    } catch (error) {
      if (orders === this.#orders) this.#told(error);
    } finally {
      if (this.#stepping === step) this.#stepping = null;
    }
  }

  /** Notes that the page has closed it: pending calls no longer matter. */
  dispose(): void {
    this.quietly({ do: "close" });
    this.#order();
    this.id = 0;
    this.#waiting.over();
    for (const timer of [this.#inspectTimer, this.#regrantTimer]) if (timer !== null) clearTimeout(timer);
  }

  /** Notes a new order, which ends everything that it does by itself. */
  #order(): void {
    this.#orders++;
    this.#rewind.stop();
  }

  setSpeed(speed: Speed): void {
    const { isPlaying, isRewinding } = this;
    this.speed = speed;
    if (isPlaying) this.play();
    else if (isRewinding) this.rewind();
  }

  /** Goes to the next or the previous of the usual speeds. */
  changeSpeed(direction: 1 | -1): void {
    const now = this.speed === "fastest" ? Infinity : this.speed.times;
    const sizes = SPEEDS.map((speed) => (speed === "fastest" ? Infinity : speed));
    const wanted = direction > 0 ? sizes.find((s) => s > now) : sizes.findLast((s) => s < now);
    if (wanted !== undefined) this.setSpeed(wanted === Infinity ? "fastest" : { times: wanted });
  }

  /** Goes to a cycle; while one is under way only the latest wish is kept. */
  seek(cycle: number): void {
    if (this.isFleet) return;
    this.#order();
    void this.#seeker.to(Math.round(Math.min(Math.max(0, cycle), this.lastCycle)));
  }

  async #seekNow(cycle: number): Promise<boolean> {
    const orders = this.#orders;
    try {
      await this.#ask({ do: "seek", cycle });
      return true;
    } catch (error) {
      if (orders === this.#orders) this.#told(error);
      return false;
    }
  }

  /** Starts anew. Returns whether the server agreed. */
  async restart(seed: number | null, text: string | null): Promise<boolean> {
    this.#order();
    const answer = await this.tell({ do: "restart", seed, text });
    if (answer === null) return false;
    if (text !== null) this.text = text;
    if (answer.is === "opened") this.#begun(answer);
    else this.#begun({ is: "opened", session: this.id, scene: this.scene, status: { ...this.status, cycle: 0 } });
    this.credit.drawn();
    this.#look();
    return true;
  }

  select(who: Who | null): void {
    const same = who && this.selected && whoKey(who) === whoKey(this.selected);
    if (same) return;
    this.selected = who;
    this.inspection = null;
    this.inspectProblem = null;
    this.#look();
    this.#inspectedAt_ms = 0;
    this.#inspectSoon();
  }

  /** Goes to an event, and selects the agent that it is about. */
  visit(event: Event): void {
    const agent = [event.who, event.with].find((who) => {
      const index = who ? this.bodies?.find(who) : undefined;
      return index !== undefined && this.bodies?.cast.is_agent[index];
    });
    if (agent) this.select(agent);
    this.seek(event.cycle);
  }

  /** Jumps to the next or the previous event of the kinds that are shown. */
  jump(direction: 1 | -1): void {
    const kinds = this.eventKinds;
    const event = this.events.neighbor(this.shown.cycle, direction, (e) => !kinds.has(e.kind));
    if (event) this.visit(event);
  }

  source(): Promise<Answer> {
    return this.#ask({ do: "source" });
  }

  /** The folder of the recording, where it is one: of such there are reports. */
  get folder(): string | null {
    const { subject } = this;
    return subject.kind === "recording" && !/\.mcap$/i.test(subject.path) ? subject.path : null;
  }

  /** The names of the recorded tables. */
  async tables(): Promise<string[]> {
    const answer = await this.tell({ do: "tables" });
    return answer?.is === "tables" ? answer.names : [];
  }

  check(text: string): Promise<Answer> {
    return this.#ask({ do: "check", text });
  }

  /** Sends a call of the editor's. */
  ask(call: Call): Promise<Answer> {
    return this.id === 0 ? Promise.reject(new Refused(NO_SESSION)) : this.#line.ask(call);
  }

  complain(problem: Problem): void {
    this.#line.problem(problem);
  }

  /** Sends a call and shows its problem, if there is one. */
  async tell(call: OwnCall): Promise<Answer | null> {
    try {
      return await this.#ask(call);
    } catch (error) {
      this.#told(error);
      return null;
    }
  }

  /** Shows a problem, but for that of the connection, which the banner tells for all calls. */
  #told(error: unknown): void {
    if (!(error instanceof Refused)) throw error;
    if (error.problem !== LOST && error.problem !== NO_SESSION) this.#line.problem(error.problem);
  }

  /** Sends a call whose failure is ignored. */
  quietly(call: OwnCall): void {
    this.#ask(call).catch(() => undefined);
  }

  #ask(call: OwnCall): Promise<Answer> {
    // Between two connections the session has no number at the server.
    if (this.id === 0) return Promise.reject(new Refused(NO_SESSION));
    return this.#line.ask({ ...call, session: this.id } as Call);
  }

  #look(): void {
    this.quietly({ do: "look", scans_of: this.selected ? [this.selected] : [] });
  }

  #inspectSoon(): void {
    if (!this.selected || this.isFleet || this.#isInspecting || this.#inspectTimer !== null) return;
    const wait_ms = Math.max(0, this.#inspectedAt_ms + INSPECT_EVERY_MS - performance.now());
    this.#inspectTimer = setTimeout(() => {
      this.#inspectTimer = null;
      void this.#inspect();
    }, wait_ms);
  }

  async #inspect(): Promise<void> {
    const who = this.selected;
    const frame = this.frame;
    if (!who) return;
    this.#isInspecting = true;
    this.#inspectedAt_ms = performance.now();
    try {
      const answer = await this.#ask({ do: "inspect", who });
      if (this.selected === who && answer.is === "inspection") {
        this.inspection = answer;
        this.inspectProblem = null;
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (this.selected === who) this.inspectProblem = error.problem;
    } finally {
      this.#isInspecting = false;
      for (const tell of this.#onFrame) tell();
      if (this.selected !== who || this.frame !== frame) this.#inspectSoon();
    }
  }
}
