/** The one text of a scenario under work: canvas, forms and text view show it and change it. */

import { Refused } from "../connection";
import type { Answer, Edit, Problem } from "../protocol";
import type { Session } from "../state/session.svelte";
import { History } from "./history";
import { isTable, isWithin, settled, type Path, type Table } from "./keypath";
import { World } from "./schema";

/** Pause in typing after which the text is checked. */
const CHECK_AFTER_MS = 300;

export type Phase = "loading" | "checking" | "checked" | "failed";

export class Draft {
  readonly session: Session;
  text = $state("");
  /** The text as it is on the disk, as far as the page knows. */
  saved = $state("");
  place = $state("");
  isLocked = $state(false);
  phase = $state<Phase>("loading");
  /** The reason why nothing could be asked, if so. */
  failure = $state.raw<Problem | null>(null);
  problems = $state.raw<Problem[]>([]);
  /** The tables of the last text that could be read. */
  model = $state.raw<Table | null>(null);
  world = $state.raw<World | null>(null);
  canUndo = $state(false);
  canRedo = $state(false);
  /** The item chosen on the canvas and shown in the forms. */
  chosen = $state.raw<Path | null>(null);
  /** The text of the file, if another program changed it. */
  theirs = $state<string | null>(null);
  /** The section that the forms show. */
  open = $state.raw<Path>([]);
  /** A problem that the open view is to bring into sight. */
  goal = $state.raw<{ problem: Problem } | null>(null);
  /** Whether the text has a file of its own by now. */
  wasSaved = $state(false);
  /** Whether a canvas shows the draft, which then starts anew with each valid text. */
  isShown = false;
  #history = new History("");
  #asked = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #queue: Promise<unknown> = Promise.resolve();
  /** The file that it was saved to, if not the one that it came from. */
  #file: string | null = null;
  /** The file of the last refused attempt to save: it holds another text. */
  #wanted: string | null = null;
  /** The text that runs now. */
  #running = "";
  #checked = "";

  constructor(session: Session) {
    this.session = session;
  }

  get isDirty(): boolean {
    return this.text !== this.saved;
  }

  get errors(): Problem[] {
    return this.problems.filter((problem) => !problem.is_warning);
  }

  /** Returns whether another text runs than this one. */
  get differsFromRun(): boolean {
    return this.text !== this.#running;
  }

  /** Resolves when the text is here, with the known facts about its keys. */
  loaded: Promise<void> = Promise.resolve();

  /** Fetches the text and the known facts about its keys. */
  load(): void {
    this.loaded = this.#load();
  }

  async #load(): Promise<void> {
    try {
      const answer = await this.session.source();
      if (answer.is !== "source") return;
      this.place = answer.place;
      this.isLocked = answer.read_only;
      this.saved = answer.text;
      this.#running = this.session.text ?? answer.text;
      this.#history = new History(this.#running);
      this.#took(false);
      await Promise.all([this.#loadSchema(), this.#settle()]);
    } catch (error) {
      this.#failed(error);
    }
  }

  async #loadSchema(): Promise<void> {
    try {
      const answer = await this.session.ask({ do: "schema", world: this.session.scene.world });
      if (answer.is === "schema" && isTable(answer.schema)) this.world = new World(answer.schema);
    } catch (error) {
      // Without a schema the text can be changed all the same.
      if (!(error instanceof Refused)) throw error;
    }
  }

  #failed(error: unknown): void {
    if (!(error instanceof Refused)) throw error;
    this.failure = error.problem;
    this.phase = "failed";
  }

  // Changes: each is one step of the history.

  /** Takes the text as it is typed. */
  type(text: string): void {
    this.#push(text, "typing", CHECK_AFTER_MS);
  }

  /** Takes another text in whole. */
  replace(text: string): void {
    this.#push(text, null, 0);
  }

  /**
   * Has the program change keys of the text; one after the other, all or nothing. The changes may depend on the text
   * as earlier changes left it. Returns whether it was done.
   */
  edit(edits: readonly Edit[] | (() => readonly Edit[])): Promise<boolean> {
    const done = this.#queue.then(() => this.#edit(edits));
    this.#queue = done.catch(() => undefined);
    return done;
  }

  async #edit(edits: readonly Edit[] | (() => readonly Edit[])): Promise<boolean> {
    await this.#upToDate();
    const wanted = typeof edits === "function" ? edits() : edits;
    if (wanted.length === 0 || this.isLocked) return false;
    const before = this.text;
    try {
      const answer = await this.session.ask({ do: "edit", session: this.session.id, text: before, edits: [...wanted] });
      if (answer.is !== "edited") return false;
      // Text typed meanwhile stays; the edit is then asked for again over it.
      if (this.text !== before) return await this.#edit(edits);
      this.#push(answer.text, null, 0);
      await this.settled;
      return true;
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.session.complain(error.problem);
      return false;
    }
  }

  /** Waits until the tables are those of the text, just-typed text included. */
  async #upToDate(): Promise<void> {
    if (this.#timer !== undefined) {
      clearTimeout(this.#timer);
      this.#timer = undefined;
      this.settled = this.#settle();
    }
    await this.settled;
  }

  undo(): void {
    if (this.#history.undo()) this.#took();
  }

  redo(): void {
    if (this.#history.redo()) this.#took();
  }

  #push(text: string, group: string | null, wait_ms: number): void {
    if (this.isLocked || text === this.text) return;
    this.#history.push(text, group, performance.now());
    this.#took(true, wait_ms);
  }

  #took(checks = true, wait_ms = 0): void {
    this.text = this.#history.now;
    this.canUndo = this.#history.canUndo;
    this.canRedo = this.#history.canRedo;
    this.session.isUnsaved = this.isDirty;
    if (!checks) return;
    this.phase = "checking";
    clearTimeout(this.#timer);
    this.#timer = undefined;
    if (wait_ms > 0) this.#timer = setTimeout(() => this.#typedOut(), wait_ms);
    else this.settled = this.#settle();
  }

  #typedOut(): void {
    this.#timer = undefined;
    this.settled = this.#settle();
  }

  /** Resolves when the answers about the newest text are known. */
  settled: Promise<void> = Promise.resolve();

  /** Checks the text, reads its tables, and shows it. */
  async #settle(): Promise<void> {
    const number = ++this.#asked;
    const text = this.text;
    const { session } = this;
    this.phase = "checking";
    try {
      const model = session.ask({ do: "model", session: session.id, text }).catch((error: unknown) => {
        if (!(error instanceof Refused)) throw error;
        return null;
      });
      const [answer, read] = await Promise.all([session.check(text), model]);
      if (number !== this.#asked) return;
      this.#learned(text, answer, read);
      if (this.isShown) await this.show();
    } catch (error) {
      if (number === this.#asked) this.#failed(error);
    }
  }

  #learned(text: string, answer: Answer, read: Answer | null): void {
    if (answer.is === "problems") this.problems = answer.problems;
    if (read?.is === "model" && isTable(read.value)) this.model = read.value;
    this.failure = null;
    this.phase = "checked";
    this.#checked = text;
  }

  /** Repeats the check if it may have failed for want of a connection. */
  recheck(): void {
    if (this.phase !== "failed") return;
    if (this.place === "") this.load();
    else this.settled = this.#settle();
  }

  /** Has the canvas show the text, if it is valid: the run starts anew with it, and waits. */
  async show(): Promise<void> {
    const { text } = this;
    const isValid = this.#checked === text && this.phase === "checked" && this.errors.length === 0;
    if (!isValid || text === this.#running) return;
    // Set before it is done, so that no caller asks for the same twice.
    const before = this.#running;
    this.#running = text;
    if (!(await this.session.restart(null, text))) this.#running = before;
  }

  /** Starts the run with this text. Returns whether the server agreed. */
  async run(): Promise<boolean> {
    await this.#queue;
    if (this.isLocked) return false;
    const { text } = this;
    const worked = await this.session.restart(null, text);
    if (worked) this.#running = text;
    else if (this.text === text) this.settled = this.#settle();
    return worked;
  }

  /** Writes the text to its file, or to another, which is its own from then on. Returns whether it is there now. */
  async save(to: string | null, over: boolean): Promise<boolean> {
    // A change that is on its way was made before.
    await this.#queue;
    const { text } = this;
    const file = to ?? this.#file;
    const answer = await this.session.tell({ do: "save", text, to: file, base: this.saved, over });
    if (answer?.is === "differs") {
      this.theirs = answer.text;
      this.#wanted = file;
    }
    if (answer?.is !== "saved") return false;
    this.#file = file;
    this.place = answer.place;
    this.saved = text;
    this.wasSaved = true;
    this.theirs = null;
    this.session.isUnsaved = this.isDirty;
    return true;
  }

  /** Writes the text over that of another program. */
  keepMine(): Promise<boolean> {
    return this.save(this.#wanted, true);
  }

  /** Takes the file's text, as one more step that can be undone. */
  takeTheirs(): void {
    if (this.theirs === null) return;
    const { theirs } = this;
    this.#file = this.#wanted;
    this.saved = theirs;
    this.theirs = null;
    this.replace(theirs);
    this.session.isUnsaved = this.isDirty;
  }

  /** Problems at a path, or also below it. */
  problemsAt(path: Path, below: boolean): Problem[] {
    return this.problems.filter((problem) => {
      if (problem.key === null || problem.key === undefined) return false;
      const at = settled(this.model ?? undefined, problem.key);
      return isWithin(at, path) && (below || at.length === path.length);
    });
  }
}

const drafts = new WeakMap<Session, Draft>();

/** The draft of a session; fetched when it is first asked for. */
export function draftOf(session: Session): Draft {
  const known = drafts.get(session);
  if (known) {
    known.recheck();
    return known;
  }
  const draft = new Draft(session);
  drafts.set(session, draft);
  draft.load();
  return draft;
}
