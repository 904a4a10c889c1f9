/** Navigation through the folders that the server offers, and the search for a file in all of them. */

import { RequestError } from "../connection";
import type { FileEntry, Problem, ServerMethod } from "../protocol";
import type { Studio } from "./studio.svelte";

export class Folders {
  entries = $state.raw<FileEntry[]>([]);
  /** Number of entries that are not listed. */
  leftOut = $state(0);
  problem = $state.raw<Problem | null>(null);
  isLoading = $state(false);
  /** Whether the entries are those of a search. */
  isSearch = $state(false);
  /** The first folder given at start: new scenarios refer to files relative to it. */
  first = "";
  /** The path of folders down to this one; null is the list of those given at start. */
  #trail = $state.raw<(string | null)[]>([null]);
  readonly folder = $derived(this.#trail.at(-1) ?? null);
  readonly canLeave = $derived(this.#trail.length > 1);
  readonly #studio: Studio;
  /** Counts requests: the answer to an earlier one is obsolete. */
  #requests = 0;

  constructor(studio: Studio) {
    this.#studio = studio;
  }

  /** Starts over, with the folders given at start. */
  start(): Promise<void> {
    this.#trail = [null];
    return this.#list(null);
  }

  enter(path: string): void {
    this.#trail = [...this.#trail, path];
    void this.#list(path);
  }

  leave(): void {
    this.#trail = this.#trail.slice(0, -1);
    void this.#list(this.folder);
  }

  /** Finds the files with a text in all folders; without one it goes back to the folder. */
  search(text: string): void {
    if (text.trim() === "") void this.#list(this.folder);
    else void this.#find(text);
  }

  /** Lists the files of all folders, or goes back to the folder. */
  showAll(text: string): void {
    if (this.isSearch && text.trim() === "") void this.#list(this.folder);
    else void this.#find("");
  }

  async #find(text: string): Promise<void> {
    if (await this.#ask({ do: "find", text })) this.isSearch = true;
  }

  async #list(folder: string | null): Promise<void> {
    if (!(await this.#ask({ do: "files", folder }))) return;
    this.isSearch = false;
    const [only] = this.entries;
    if (folder !== null) return;
    this.first = only?.kind === "folder" ? only.path : (only?.path ?? "").replace(/[^/]*$/, "");
    // A single folder is no choice.
    if (this.entries.length === 1 && only?.kind === "folder") {
      this.#trail = [only.path];
      await this.#list(only.path);
    }
  }

  /** Requests entries. Returns whether they are shown. */
  async #ask(call: ServerMethod): Promise<boolean> {
    const number = ++this.#requests;
    this.problem = null;
    this.isLoading = true;
    try {
      const answer = await this.#studio.request(call);
      if (number !== this.#requests || answer.is !== "files") return false;
      this.entries = answer.entries;
      this.leftOut = answer.left_out;
      return true;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (number !== this.#requests) return false;
      this.problem = error.problem;
      this.entries = [];
      this.leftOut = 0;
      return false;
    } finally {
      if (number === this.#requests) this.isLoading = false;
    }
  }
}
