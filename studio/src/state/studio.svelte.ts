/** All open sessions, the connection that they share, and the choices of the page as a whole. */

import { Connection, LOST, Refused, problemOf, type Listener, type Surroundings } from "../connection";
import { STANDING_WORDS, type Standing } from "../enter";
import { HEADER_BYTES } from "../decode";
import { VERSION, type Named, type Notice, type Problem, type Subject } from "../protocol";
import { Comparison } from "./comparison.svelte";
import { remember } from "./recents";
import { Session } from "./session.svelte";

/** Sessions side by side at most. */
export const MOST_SESSIONS = 4;

/** Milliseconds after which the page looks again whether a fleet flies where one was lost. */
export const FIND_AGAIN_MS = 2000;

export interface Banner {
  words: string;
  isBad: boolean;
}

/** The surroundings that a studio needs besides sockets: its standing with the server. */
export interface Around extends Surroundings {
  standing(): Promise<Standing>;
}

/** A sweep, by its folder. */
export interface Sweep {
  folder: string;
  name: string;
}

type Hello = Extract<Notice, { notice: "hello" }>;

export class Studio {
  hello = $state.raw<Hello | null>(null);
  isConnected = $state(false);
  banner = $state.raw<Banner | null>(null);
  problems = $state.raw<{ key: number; problem: Problem }[]>([]);
  sessions = $state.raw<Session[]>([]);
  /** The sweep that is shown in the place of sessions, and the one that was last. */
  sweep = $state.raw<Sweep | null>(null);
  lastSweep = $state.raw<Sweep | null>(null);
  #activeKey = $state(0);
  /** All sessions beside each other, or the active one only. */
  sideBySide = $state(false);
  /** Transport commands go to all sessions. */
  inStep = $state(false);
  readonly comparison = new Comparison();
  readonly #connection: Connection;
  readonly #around: Around;
  /** Counts greetings and losses: work begun before one of them is of no more use. */
  #generation = 0;
  #problemKeys = 0;

  constructor(around: Around) {
    const listener: Listener = {
      notice: (notice) => this.#notice(notice),
      frame: (bytes) => this.#frame(bytes),
      problem: (problem) => this.problem(problem),
      lost: (attempt, wait_ms) => this.#lost(attempt, wait_ms),
    };
    this.#around = around;
    this.#connection = new Connection(listener, around);
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

  /** The sessions that a transport command is meant for. */
  get led(): Session[] {
    const meant = this.inStep ? this.sessions : this.sessions.filter((session) => session === this.active);
    return meant.filter((session) => !session.isFleet);
  }

  /** The sessions that are to be seen. */
  get visible(): Session[] {
    if (this.sideBySide) return this.sessions;
    return this.active ? [this.active] : [];
  }

  connect(): void {
    this.#connection.connect();
  }

  readonly ask: Connection["ask"] = (call) => this.#connection.ask(call);

  problem(problem: Problem): void {
    const same = this.problems.some(({ problem: p }) => p.place === problem.place && p.cause === problem.cause);
    if (same) return;
    this.problems = [...this.problems.slice(-3), { key: ++this.#problemKeys, problem }];
  }

  dismiss(key: number): void {
    this.problems = this.problems.filter((one) => one.key !== key);
  }

  /** Opens a subject in a new session and shows it. Returns whether that worked. */
  async open(subject: Subject, seed: number | null = null): Promise<boolean> {
    if (this.sessions.length >= MOST_SESSIONS) {
      this.problem(problemOf("sessions", `${MOST_SESSIONS} sessions are open, which is the most`, "close one first"));
      return false;
    }
    const session = new Session(subject, { ask: this.ask, problem: (problem) => this.problem(problem) });
    if (!(await this.#openAt(session, seed))) return false;
    // The studio knows a fleet only as long as its command line names it.
    if (!session.isFleet) remember(subject, session.scene.name);
    this.sessions = [...this.sessions, session];
    this.activeKey = session.key;
    this.#deliver(session);
    return true;
  }

  /** Opens the subject of a session; a refusal is told unless `quiet`. Returns whether it is open. */
  async #openAt(session: Session, seed: number | null, quiet = false): Promise<boolean> {
    try {
      const answer = await this.ask({ do: "open", what: session.subject, seed });
      if (answer.is !== "opened") return false;
      session.opened(answer);
      return true;
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      // The banner tells of a lost connection, for all sessions at once.
      if (error.problem !== LOST && !quiet) this.problem(error.problem);
      return false;
    }
  }

  // Transport, of all sessions or of the active one.

  play(): void {
    for (const session of this.led) session.play();
  }

  /** Pauses if the active session moves, and plays otherwise. */
  toggle(): void {
    if (this.active?.isMoving) this.pause();
    else this.play();
  }

  /** Plays backwards, or pauses if the active session already does. */
  toggleBack(): void {
    if (this.active?.isRewinding) return this.pause();
    for (const session of this.led) session.rewind();
  }

  pause(): void {
    for (const session of this.led) session.pause();
  }

  step(cycles: number): void {
    for (const session of this.led) session.step(cycles);
  }

  seek(cycle: number): void {
    for (const session of this.led) session.seek(cycle);
  }

  close(session: Session): void {
    session.dispose();
    const at = this.sessions.indexOf(session);
    this.sessions = this.sessions.filter((one) => one !== session);
    if (this.activeKey === session.key) this.activeKey = this.sessions[Math.max(0, at - 1)]?.key ?? 0;
    if (this.sessions.length < 2) this.sideBySide = this.inStep = false;
    this.comparison.stop();
  }

  /** The two runs that can be compared: those in step, the active one and the first other. */
  get pair(): [Session, Session] | null {
    const active = this.active;
    const other = this.sessions.find((one) => one !== active);
    if (!this.inStep || !active || !other || active.isFleet || other.isFleet) return null;
    return this.sessions.indexOf(other) < this.sessions.indexOf(active) ? [other, active] : [active, other];
  }

  /** Looks for the first difference of the two, or gives the search up. */
  toggleComparison(): void {
    if (this.comparison.isRunning) return this.comparison.stop();
    if (this.pair) void this.comparison.find(...this.pair);
  }

  #byId(id: number): Session | undefined {
    return this.sessions.find((session) => session.id === id);
  }

  /** Notices and frames of sessions that came before the page knew their numbers. */
  readonly #early = new Map<number, (Notice | ArrayBuffer)[]>();

  #notice(notice: Notice): void {
    if (notice.notice === "hello") return void this.#greeted(notice);
    const session = this.#byId(notice.session);
    if (!session) return this.#keep(notice.session, notice);
    if (notice.notice === "cast") session.takeCast(notice);
    else if (notice.notice === "status") session.takeStatus(notice);
    else this.#ended(session, notice.problem);
  }

  /** Notes the end of a session; where a fleet flew, another one may fly. */
  #ended(session: Session, problem: Problem): void {
    session.takeEnd(problem);
    if (session.isFleet) this.#findAgain(session);
  }

  /** Looks now and then whether a fleet flies where one has ended or was lost, until the session is closed. */
  #findAgain(session: Session): void {
    const generation = this.#generation;
    this.#around.after(FIND_AGAIN_MS, () => void this.#look(session, generation));
  }

  async #look(session: Session, generation: number): Promise<void> {
    // A new connection opens all sessions again by itself.
    const isWanted = (): boolean =>
      generation === this.#generation && this.sessions.includes(session) && session.ended !== null;
    if (!isWanted()) return;
    if (await this.#openAt(session, null, true)) this.#deliver(session);
    else if (isWanted()) this.#findAgain(session);
  }

  #frame(bytes: ArrayBuffer): void {
    if (bytes.byteLength < HEADER_BYTES) return;
    const id = new DataView(bytes).getUint32(8, true);
    const session = this.#byId(id);
    if (session) session.takeFrame(bytes);
    else this.#keep(id, bytes);
  }

  #keep(id: number, what: Notice | ArrayBuffer): void {
    if (this.#early.size > 8) this.#early.clear();
    const kept = this.#early.get(id) ?? [];
    this.#early.set(id, [...kept.slice(-8), what]);
  }

  /** Hands over the messages that came before the page knew the session. */
  #deliver(session: Session): void {
    const kept = this.#early.get(session.id) ?? [];
    this.#early.delete(session.id);
    for (const what of kept) {
      if (what instanceof ArrayBuffer) this.#frame(what);
      else this.#notice(what);
    }
  }

  async #greeted(hello: Hello): Promise<void> {
    if (hello.version !== VERSION) {
      const words = `The server speaks version ${hello.version} of the protocol, this page ${VERSION}: reload the page.`;
      this.banner = { words, isBad: true };
      return;
    }
    const generation = ++this.#generation;
    const isFirst = this.hello === null;
    this.hello = hello;
    this.isConnected = true;
    this.banner = null;
    if (this.sessions.length > 0) await this.#reopen(generation);
    else if (isFirst) for (const named of hello.open) await this.#openNamed(named);
  }

  /** Opens the subjects that the command line named. */
  async #openNamed({ kind, path }: Named): Promise<void> {
    if (kind === "sweep") this.openSweep(path, path.split("/").at(-1) ?? path);
    else await this.open({ kind, path } as Subject);
  }

  #lost(attempt: number, wait_ms: number): void {
    const generation = ++this.#generation;
    this.isConnected = false;
    this.#early.clear();
    for (const session of this.sessions) session.cutOff();
    const wait = wait_ms < 1000 ? "at once" : `in ${Math.round(wait_ms / 1000)} s`;
    const say = (standing: Standing): void => {
      this.banner = {
        words: `${STANDING_WORDS[standing]} Attempt ${attempt} to connect again comes ${wait}.`,
        isBad: true,
      };
    };
    // The last known standing stays until the server has given the new one.
    say(this.#standing);
    void this.#around.standing().then((standing) => {
      if (generation !== this.#generation) return;
      this.#standing = standing;
      say(standing);
    });
  }

  /** The page's standing with the server when it was asked last. */
  #standing: Standing = "silent";

  /** Opens all sessions again, brings each to the cycle where it was, and plays those that played. */
  async #reopen(generation: number): Promise<void> {
    const told: string[] = [];
    let missing = 0;
    for (const session of this.sessions) {
      const isOpen = await this.#openAt(session, session.seed);
      if (generation !== this.#generation) return;
      if (!isOpen) {
        this.#ended(
          session,
          problemOf(session.scene.name, "it could not be opened again", "open it anew, or close it"),
        );
        missing++;
        continue;
      }
      this.#deliver(session);
      const cycle = await session.resume();
      if (generation !== this.#generation) return;
      told.push(`${session.scene.name} at cycle ${cycle}`);
    }
    const words = told.length > 0 ? `Connected again; reopened ${told.join(", ")}.` : "Connected again.";
    const more = missing > 0 ? ` ${missing} could not be opened again.` : "";
    this.banner = { words: words + more, isBad: false };
  }
}
