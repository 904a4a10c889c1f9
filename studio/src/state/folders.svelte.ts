/** Navigation through the folders that the server offers. */

import { RequestError } from "../connection";
import type { FileEntry, Problem } from "../protocol";
import type { Studio } from "./studio.svelte";

export class Folders {
  entries = $state.raw<FileEntry[]>([]);
  problem = $state.raw<Problem | null>(null);
  /** The first folder given at start: new scenarios refer to files relative to it. */
  first = "";
  /** The path of folders down to this one; null is the list of those given at start. */
  #trail = $state.raw<(string | null)[]>([null]);
  readonly folder = $derived(this.#trail.at(-1) ?? null);
  readonly canLeave = $derived(this.#trail.length > 1);
  readonly #studio: Studio;

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

  async #list(folder: string | null): Promise<void> {
    this.problem = null;
    try {
      const answer = await this.#studio.request({ do: "files", folder });
      if (answer.is !== "files") return;
      this.entries = answer.entries;
      const [only] = answer.entries;
      if (folder !== null) return;
      this.first = only?.kind === "folder" ? only.path : (only?.path ?? "").replace(/[^/]*$/, "");
      // A single folder is no choice.
      if (answer.entries.length === 1 && only?.kind === "folder") {
        this.#trail = [only.path];
        await this.#list(only.path);
      }
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.problem = error.problem;
      this.entries = [];
    }
  }
}
