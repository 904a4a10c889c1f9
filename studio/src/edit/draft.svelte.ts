/** The text of an edited scenario: canvas, forms and text view all show and change it. */

import { RequestError } from "../connection";
import type { ReplyBody, Edit, Problem } from "../protocol";
import type { Session } from "../state/session.svelte";
import { TextHistory } from "./history";
import { editingOf, NO_EDITING, type Editing } from "./editing";
import { isTable, isWithin, normalizedPath, type Path, type TomlTable } from "./keypath";
import { WorldSchema } from "./schema";

/** Pause in typing before the text is checked. */
const CHECK_DELAY_MS = 300;

export type Phase = "loading" | "checking" | "checked" | "failed";

export class Draft {
  readonly session: Session;
  text = $state("");
  /** The text on the disk, as far as the page knows. */
  saved = $state("");
  place = $state("");
  isLocked = $state(false);
  phase = $state<Phase>("loading");
  /** The reason why the last check failed, if it did. */
  failure = $state.raw<Problem | null>(null);
  problems = $state.raw<Problem[]>([]);
  /** The values of the last text that could be parsed. */
  model = $state.raw<TomlTable | null>(null);
  world = $state.raw<WorldSchema | null>(null);
  /** The tools that its world declares. */
  editing = $state.raw<Editing>(NO_EDITING);
  canUndo = $state(false);
  canRedo = $state(false);
  /** The item selected on the canvas and shown in the forms. */
  selected = $state.raw<Path | null>(null);
  /** The text of the file, if another program changed it. */
  theirs = $state<string | null>(null);
  /** The section that the forms show. */
  open = $state.raw<Path>([]);
  /** A problem that the open view should show. */
  shownProblem = $state.raw<{ problem: Problem } | null>(null);
  /** Whether the text has been saved to a file. */
  wasSaved = $state(false);
  /** Whether a canvas shows the draft; the run then restarts with each valid text. */
  isShown = false;
  #history = new TextHistory("");
  #checks = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #queue: Promise<unknown> = Promise.resolve();
  /** The file that it was saved to, if it differs from its source. */
  #file: string | null = null;
  /** The file of the last refused attempt to save, which has another text. */
  #refusedFile: string | null = null;
  /** The text of the current run. */
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

  /** Returns whether the run has another text. */
  get differsFromRun(): boolean {
    return this.text !== this.#running;
  }

  /** Resolves when the text and the schema are loaded. */
  whenLoaded: Promise<void> = Promise.resolve();

  /** Fetches the text and the schema. */
  load(): void {
    this.whenLoaded = this.#load();
  }

  async #load(): Promise<void> {
    try {
      const answer = await this.session.client.source();
      if (answer.is !== "source") return;
      this.place = answer.place;
      this.isLocked = answer.read_only;
      this.saved = answer.text;
      this.#running = this.session.run.text ?? answer.text;
      this.#history = new TextHistory(this.#running);
      this.#onTextChange(false);
      // The schema brings the tools of the canvas: once a draft is checked, they are there.
      await this.#loadSchema();
      await this.#checkNow();
    } catch (error) {
      this.#onFailure(error);
    }
  }

  async #loadSchema(): Promise<void> {
    try {
      const answer = await this.session.client.schema(this.session.run.scene.world);
      if (answer.is !== "schema") return;
      if (isTable(answer.schema)) this.world = new WorldSchema(answer.schema);
      this.editing = editingOf(answer.editing);
    } catch (error) {
      // Without a schema the text can still be edited.
      if (!(error instanceof RequestError)) throw error;
    }
  }

  #onFailure(error: unknown): void {
    if (!(error instanceof RequestError)) throw error;
    this.failure = error.problem;
    this.phase = "failed";
  }

  // Edits: each is one step of the history.

  /** Replaces the text while typing. */
  type(text: string): void {
    this.#push(text, "typing", CHECK_DELAY_MS);
  }

  /** Replaces the whole text. */
  replace(text: string): void {
    this.#push(text, null, 0);
  }

  /**
   * Lets the server edit keys of the text: in order, all or none. The edits may depend on the text as earlier edits left
   * it. Returns whether they were applied.
   */
  edit(edits: readonly Edit[] | (() => readonly Edit[])): Promise<boolean> {
    const done = this.#queue.then(() => this.#edit(edits));
    this.#queue = done.catch(() => undefined);
    return done;
  }

  async #edit(edits: readonly Edit[] | (() => readonly Edit[])): Promise<boolean> {
    await this.#waitUntilChecked();
    const list = typeof edits === "function" ? edits() : edits;
    if (list.length === 0 || this.isLocked) return false;
    const before = this.text;
    try {
      const answer = await this.session.client.request({ do: "edit", text: before, edits: [...list] });
      if (answer.is !== "edited") return false;
      // Text typed meanwhile is kept: the edit is then repeated on it.
      if (this.text !== before) return await this.#edit(edits);
      this.session.client.mend("edit");
      this.#push(answer.text, null, 0);
      await this.whenChecked;
      return true;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.session.client.reportUntilMended("edit", error.problem);
      return false;
    }
  }

  /** Waits until the values are those of the current text. */
  async #waitUntilChecked(): Promise<void> {
    if (this.#timer !== undefined) {
      clearTimeout(this.#timer);
      this.#timer = undefined;
      this.whenChecked = this.#checkNow();
    }
    await this.whenChecked;
  }

  undo(): void {
    if (this.#history.undo()) this.#onTextChange();
  }

  redo(): void {
    if (this.#history.redo()) this.#onTextChange();
  }

  #push(text: string, group: string | null, wait_ms: number): void {
    if (this.isLocked || text === this.text) return;
    this.#history.push(text, group, performance.now());
    this.#onTextChange(true, wait_ms);
  }

  #onTextChange(checks = true, wait_ms = 0): void {
    this.text = this.#history.now;
    this.canUndo = this.#history.canUndo;
    this.canRedo = this.#history.canRedo;
    this.session.run.isUnsaved = this.isDirty;
    if (!checks) return;
    this.phase = "checking";
    clearTimeout(this.#timer);
    this.#timer = undefined;
    if (wait_ms > 0) this.#timer = setTimeout(() => this.#onTypingPause(), wait_ms);
    else this.whenChecked = this.#checkNow();
  }

  #onTypingPause(): void {
    this.#timer = undefined;
    this.whenChecked = this.#checkNow();
  }

  /** Resolves when the newest text is checked. */
  whenChecked: Promise<void> = Promise.resolve();

  /** Checks the text, reads its values, and shows it. */
  async #checkNow(): Promise<void> {
    const number = ++this.#checks;
    const text = this.text;
    const { session } = this;
    this.phase = "checking";
    try {
      const model = session.client.request({ do: "model", text }).catch((error: unknown) => {
        if (!(error instanceof RequestError)) throw error;
        return null;
      });
      const [answer, read] = await Promise.all([session.client.check(text), model]);
      if (number !== this.#checks) return;
      this.#onChecked(text, answer, read);
      if (this.isShown) await this.runIfValid();
    } catch (error) {
      if (number === this.#checks) this.#onFailure(error);
    }
  }

  #onChecked(text: string, answer: ReplyBody, read: ReplyBody | null): void {
    if (answer.is === "problems") this.problems = answer.problems;
    if (read?.is === "model" && isTable(read.value)) this.model = read.value;
    this.failure = null;
    this.phase = "checked";
    // A run that was refused for its text is refused no longer, and an edit that did not fit may fit now.
    if (this.errors.length === 0) {
      this.session.client.mend("restart");
      this.session.client.mend("edit");
      this.session.client.mend("save");
    }
    this.#checked = text;
  }

  /** Repeats the check if it failed, as without a connection. */
  recheck(): void {
    if (this.phase !== "failed") return;
    if (this.place === "") this.load();
    else this.whenChecked = this.#checkNow();
  }

  /** Restarts the run, paused, with the text if it is valid, so that the canvas shows it. */
  async runIfValid(): Promise<void> {
    const { text } = this;
    const isValid = this.#checked === text && this.phase === "checked" && this.errors.length === 0;
    if (!isValid || text === this.#running) return;
    // Set in advance, so that no caller requests the same restart twice.
    const before = this.#running;
    this.#running = text;
    if (!(await this.session.restart(null, text))) this.#running = before;
  }

  /** Restarts the run with this text. Returns whether the server accepted. */
  async run(): Promise<boolean> {
    await this.#queue;
    if (this.isLocked) return false;
    const { text } = this;
    const isStarted = await this.session.restart(null, text);
    if (isStarted) this.#running = text;
    else if (this.text === text) this.whenChecked = this.#checkNow();
    return isStarted;
  }

  /** Saves the text to its file, or to another one, which becomes its own. Returns whether it was saved. */
  async save(to: string | null, overwrite: boolean): Promise<boolean> {
    // Pending edits come first.
    await this.#queue;
    const { text } = this;
    const file = to ?? this.#file;
    const answer = await this.session.client.send({ do: "save", text, to: file, base: this.saved, overwrite });
    if (answer?.is === "differs") {
      this.theirs = answer.text;
      this.#refusedFile = file;
    }
    if (answer?.is !== "saved") return false;
    this.#file = file;
    this.place = answer.place;
    this.saved = text;
    this.wasSaved = true;
    this.theirs = null;
    this.session.run.isUnsaved = this.isDirty;
    return true;
  }

  /** Overwrites the file that another program has changed. */
  keepMine(): Promise<boolean> {
    return this.save(this.#refusedFile, true);
  }

  /** Takes the file's text as one undoable step. */
  takeTheirs(): void {
    if (this.theirs === null) return;
    const { theirs } = this;
    this.#file = this.#refusedFile;
    this.saved = theirs;
    this.theirs = null;
    this.replace(theirs);
    this.session.run.isUnsaved = this.isDirty;
  }

  /** Problems at a path and, if `below`, under it. */
  problemsAt(path: Path, below: boolean): Problem[] {
    return this.problems.filter((problem) => {
      if (problem.key === null || problem.key === undefined) return false;
      const at = normalizedPath(this.model ?? undefined, problem.key);
      return isWithin(at, path) && (below || at.length === path.length);
    });
  }
}

const drafts = new WeakMap<Session, Draft>();

/** The draft of a session; loaded on first use. */
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
