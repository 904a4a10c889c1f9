/** All open sessions, their shared connection, and the settings of the page as a whole. */

import { Connection, CONNECTION_LOST, RequestError, makeProblem, type Listener, type Environment } from "../connection";
import { ACCESS_TEXTS, type AccessStatus } from "../auth";
import { HEADER_BYTES } from "../decode";
import { VERSION, type TargetRef, type ServerNotification, type Problem, type OpenTarget } from "../protocol";
import { Comparison } from "./comparison.svelte";
import { remember } from "./recents";
import { Session } from "./session.svelte";

/** Maximum number of open sessions. */
export const MAX_SESSIONS = 4;

/** Delay before the page tries to reopen a lost fleet. */
export const FLEET_RETRY_DELAY_MS = 2000;

export interface Banner {
  words: string;
  isBad: boolean;
}

/** The environment of a studio: sockets, timers, and the access status. */
export interface StudioEnvironment extends Environment {
  accessStatus(): Promise<AccessStatus>;
  /** Whether the page is a replay in one file. */
  readonly isReplay?: boolean;
}

/** A sweep, by its folder. */
export interface Sweep {
  folder: string;
  name: string;
}

type Hello = Extract<ServerNotification, { notice: "hello" }>;

export class Studio {
  hello = $state.raw<Hello | null>(null);
  isConnected = $state(false);
  banner = $state.raw<Banner | null>(null);
  problems = $state.raw<{ key: number; problem: Problem }[]>([]);
  sessions = $state.raw<Session[]>([]);
  /** The sweep shown instead of sessions, and the last one. */
  sweep = $state.raw<Sweep | null>(null);
  lastSweep = $state.raw<Sweep | null>(null);
  #activeKey = $state(0);
  /** Whether all sessions are shown side by side, or only the active one. */
  sideBySide = $state(false);
  /** Whether transport commands apply to all sessions. */
  inStep = $state(false);
  /** The session whose picture takes the focus next, so that keys act on it. */
  pictureRequest = $state.raw<{ key: number } | null>(null);
  /** Paths of copies of dropped files, which are gone with the server. */
  readonly copies = new Set<string>();
  readonly comparison = new Comparison();
  readonly #connection: Connection;
  readonly #environment: StudioEnvironment;
  /** Counts connections and losses: results of earlier generations are obsolete. */
  #generation = 0;
  #problemKeys = 0;

  constructor(around: StudioEnvironment) {
    const listener: Listener = {
      onNotification: (notice) => this.#onNotification(notice),
      onFrame: (bytes) => this.#onFrame(bytes),
      onProblem: (problem) => this.onProblem(problem),
      onLost: (attempt, wait_ms) => this.#onConnectionLost(attempt, wait_ms),
    };
    this.#environment = around;
    this.#connection = new Connection(listener, around);
  }

  /** Returns whether the page is a replay in one file: there is nothing else to open, and nothing to edit. */
  get isReplay(): boolean {
    return this.#environment.isReplay ?? false;
  }

  get activeKey(): number {
    return this.#activeKey;
  }

  /** Shows a session. */
  set activeKey(key: number) {
    this.#activeKey = key;
    this.sweep = null;
  }

  /** Shows a sweep. */
  openSweep(folder: string, name: string): void {
    this.sweep = this.lastSweep = { folder, name };
  }

  closeSweep(): void {
    this.sweep = this.lastSweep = null;
  }

  get active(): Session | null {
    return this.sessions.find((session) => session.key === this.activeKey) ?? null;
  }

  /** The sessions that transport commands apply to. */
  get controlled(): Session[] {
    const targets = this.inStep ? this.sessions : this.sessions.filter((session) => session === this.active);
    return targets.filter((session) => !session.isFleet);
  }

  /** The visible sessions. */
  get visible(): Session[] {
    if (this.sideBySide) return this.sessions;
    return this.active ? [this.active] : [];
  }

  connect(): void {
    this.#connection.connect();
  }

  readonly request: Connection["request"] = (call) => this.#connection.request(call);
  readonly #requestSession: Connection["requestSession"] = (session, call) =>
    this.#connection.requestSession(session, call);

  onProblem(problem: Problem): void {
    const same = this.problems.some(({ problem: p }) => p.place === problem.place && p.cause === problem.cause);
    if (same) return;
    this.problems = [...this.problems.slice(-3), { key: ++this.#problemKeys, problem }];
  }

  #onMended({ place, cause }: Problem): void {
    this.problems = this.problems.filter(({ problem }) => problem.place !== place || problem.cause !== cause);
  }

  dismiss(key: number): void {
    this.problems = this.problems.filter((one) => one.key !== key);
  }

  /** Opens a target in a new session and shows it. Returns whether that succeeded. */
  async open(target: OpenTarget, seed: number | null = null): Promise<boolean> {
    if (this.sessions.length >= MAX_SESSIONS) {
      this.onProblem(
        makeProblem("sessions", `${MAX_SESSIONS} sessions are open, which is the maximum`, "close one first"),
      );
      return false;
    }
    const session = new Session(target, {
      request: this.request,
      requestSession: this.#requestSession,
      onProblem: (problem) => this.onProblem(problem),
      onMended: (problem) => this.#onMended(problem),
      isReplay: this.isReplay,
    });
    if (!(await this.#openAt(session, seed))) return false;
    // A fleet is known only as long as it is on the studio's command line.
    if (!session.isFleet && !session.isReplay && !this.isCopy(target)) remember(target, session.run.scene.name);
    this.sessions = [...this.sessions, session];
    this.activeKey = session.key;
    this.requestPicture();
    this.#deliver(session);
    return true;
  }

  /** Has the picture of the active session take the focus. */
  requestPicture(): void {
    this.pictureRequest = { key: this.activeKey };
  }

  /** Returns whether a target is a copy of a dropped file. */
  isCopy(target: OpenTarget): boolean {
    return "path" in target && this.copies.has(target.path);
  }

  /** Opens the target of a session; reports a refusal unless `quiet`. Returns whether it is open. */
  async #openAt(session: Session, seed: number | null, quiet = false): Promise<boolean> {
    try {
      const answer = await this.request({ do: "open", target: session.target, seed });
      if (answer.is !== "opened") return false;
      session.onOpened(answer);
      return true;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      // One banner reports a lost connection for all sessions.
      if (error.problem !== CONNECTION_LOST && !quiet) this.onProblem(error.problem);
      return false;
    }
  }

  // Transport, of all sessions or of the active one.

  play(): void {
    for (const session of this.controlled) session.playback.play();
  }

  /** Pauses if the active session plays, and plays otherwise. */
  toggle(): void {
    if (this.active?.playback.isMoving) this.pause();
    else this.play();
  }

  /** Plays backwards, or pauses if the active session already does. */
  toggleBack(): void {
    if (this.active?.playback.isRewinding) return this.pause();
    for (const session of this.controlled) session.playback.rewind();
  }

  pause(): void {
    for (const session of this.controlled) session.playback.pause();
  }

  step(cycles: number): void {
    for (const session of this.controlled) session.playback.step(cycles);
  }

  seek(cycle: number): void {
    for (const session of this.controlled) session.playback.seek(cycle);
  }

  close(session: Session): void {
    session.dispose();
    const at = this.sessions.indexOf(session);
    this.sessions = this.sessions.filter((one) => one !== session);
    if (this.activeKey === session.key) this.activeKey = this.sessions[Math.max(0, at - 1)]?.key ?? 0;
    if (this.sessions.length < 2) this.sideBySide = this.inStep = false;
    this.comparison.stop();
  }

  /** The two runs to compare: of sessions side by side or in step, the active one and the first other. */
  get pair(): [Session, Session] | null {
    const active = this.active;
    const other = this.sessions.find((one) => one !== active);
    if (!(this.inStep || this.sideBySide) || !active || !other || active.isFleet || other.isFleet) return null;
    return this.sessions.indexOf(other) < this.sessions.indexOf(active) ? [other, active] : [active, other];
  }

  /** Starts or stops the search for the first difference of the two. */
  toggleComparison(): void {
    if (this.comparison.isRunning) return this.comparison.stop();
    if (this.pair) void this.comparison.find(...this.pair);
  }

  #byId(id: number): Session | undefined {
    return this.sessions.find((session) => session.client.id === id);
  }

  /** Notifications and frames of sessions whose ids the page does not know yet. */
  readonly #undelivered = new Map<number, (ServerNotification | ArrayBuffer)[]>();

  #onNotification(notice: ServerNotification): void {
    if (notice.notice === "hello") return void this.#onHello(notice);
    const session = this.#byId(notice.session);
    if (!session) return this.#keepUndelivered(notice.session, notice);
    if (notice.notice === "bodies") session.onBodyTable(notice);
    else if (notice.notice === "status") session.onStatus(notice);
    else this.#onEnded(session, notice.problem);
  }

  /** A session has ended; at the address of a fleet another one may start. */
  #onEnded(session: Session, problem: Problem): void {
    session.onEnded(problem);
    if (session.isFleet) this.#retryFleet(session);
  }

  /** Tries at intervals to reopen a fleet that has ended or was lost, until the session is closed. */
  #retryFleet(session: Session): void {
    const generation = this.#generation;
    this.#environment.after(FLEET_RETRY_DELAY_MS, () => void this.#reopenFleet(session, generation));
  }

  async #reopenFleet(session: Session, generation: number): Promise<void> {
    // A new connection reopens all sessions anyway.
    const isCurrent = (): boolean =>
      generation === this.#generation && this.sessions.includes(session) && session.client.ended !== null;
    if (!isCurrent()) return;
    if (await this.#openAt(session, null, true)) this.#deliver(session);
    else if (isCurrent()) this.#retryFleet(session);
  }

  #onFrame(bytes: ArrayBuffer): void {
    if (bytes.byteLength < HEADER_BYTES) return;
    const id = new DataView(bytes).getUint32(8, true);
    const session = this.#byId(id);
    if (session) session.onFrame(bytes);
    else this.#keepUndelivered(id, bytes);
  }

  #keepUndelivered(id: number, message: ServerNotification | ArrayBuffer): void {
    if (this.#undelivered.size > 8) this.#undelivered.clear();
    const kept = this.#undelivered.get(id) ?? [];
    this.#undelivered.set(id, [...kept.slice(-8), message]);
  }

  /** Delivers the messages that arrived before the page knew the session. */
  #deliver(session: Session): void {
    const kept = this.#undelivered.get(session.client.id) ?? [];
    this.#undelivered.delete(session.client.id);
    for (const message of kept) {
      if (message instanceof ArrayBuffer) this.#onFrame(message);
      else this.#onNotification(message);
    }
  }

  async #onHello(hello: Hello): Promise<void> {
    if (hello.version !== VERSION) {
      const words = `The server uses version ${hello.version} of the protocol, this page ${VERSION}: reload the page.`;
      this.banner = { words, isBad: true };
      return;
    }
    const generation = ++this.#generation;
    const isFirst = this.hello === null;
    this.hello = hello;
    this.isConnected = true;
    this.banner = null;
    if (this.sessions.length > 0) await this.#reopen(generation);
    else if (isFirst) await this.#openAll(hello.open);
  }

  /** Opens what the page is started with; runs of a replay are there to be compared. */
  async #openAll(targets: readonly TargetRef[]): Promise<void> {
    for (const target of targets) await this.#openTarget(target);
    if (!this.isReplay || this.sessions.length < 2) return;
    this.activeKey = this.sessions[0]!.key;
    this.sideBySide = this.inStep = true;
  }

  /** Opens a target of the command line. */
  async #openTarget({ kind, path }: TargetRef): Promise<void> {
    if (kind === "sweep") this.openSweep(path, path.split("/").at(-1) ?? path);
    else await this.open({ kind, path } as OpenTarget);
  }

  #onConnectionLost(attempt: number, wait_ms: number): void {
    const generation = ++this.#generation;
    this.isConnected = false;
    this.#undelivered.clear();
    for (const session of this.sessions) session.onConnectionLost();
    const wait = wait_ms < 1000 ? "now" : `in ${Math.round(wait_ms / 1000)} s`;
    const report = (status: AccessStatus): void => {
      this.banner = {
        words: `${ACCESS_TEXTS[status]} Attempt ${attempt} to reconnect ${wait}.`,
        isBad: true,
      };
    };
    // The last known status is shown until the new one arrives.
    report(this.#accessStatus);
    void this.#environment.accessStatus().then((status) => {
      if (generation !== this.#generation) return;
      this.#accessStatus = status;
      report(status);
    });
  }

  /** The last known access status. */
  #accessStatus: AccessStatus = "silent";

  /** Reopens all sessions, seeks each to the cycle where it was, and plays those that were playing. */
  async #reopen(generation: number): Promise<void> {
    const reopened: string[] = [];
    let missing = 0;
    for (const session of this.sessions) {
      const isOpen = await this.#openAt(session, session.seed);
      if (generation !== this.#generation) return;
      if (!isOpen) {
        this.#onEnded(
          session,
          makeProblem(session.run.scene.name, "it could not be reopened", "open it again, or close it"),
        );
        missing++;
        continue;
      }
      this.#deliver(session);
      const cycle = await session.resume();
      if (generation !== this.#generation) return;
      reopened.push(`${session.run.scene.name} at cycle ${cycle}`);
    }
    const words = reopened.length > 0 ? `Reconnected; reopened ${reopened.join(", ")}.` : "Reconnected.";
    const more = missing > 0 ? ` ${missing} could not be reopened.` : "";
    this.banner = { words: words + more, isBad: false };
  }
}
