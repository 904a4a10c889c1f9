/** A walk through the folders that the server names. */

import { Refused } from "../connection";
import type { FileEntry, Problem } from "../protocol";
import type { Studio } from "./studio.svelte";

export class Folders {
  entries = $state.raw<FileEntry[]>([]);
  problem = $state.raw<Problem | null>(null);
  /** The first folder that was named at start, relative to which new scenarios name files. */
  first = "";
  /** The folders down to this one; null is the list of those that were named at start. */
  #trail = $state.raw<(string | null)[]>([null]);
  readonly folder = $derived(this.#trail.at(-1) ?? null);
  readonly canLeave = $derived(this.#trail.length > 1);
  readonly #studio: Studio;

  constructor(studio: Studio) {
    this.#studio = studio;
  }

  /** Begins anew, with the folders that were named at start. */
  begin(): Promise<void> {
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

  async #list(wanted: string | null): Promise<void> {
    this.problem = null;
    try {
      const answer = await this.#studio.ask({ do: "files", folder: wanted });
      if (answer.is !== "files") return;
      this.entries = answer.entries;
      const [only] = answer.entries;
      if (wanted !== null) return;
      this.first = only?.kind === "folder" ? only.path : (only?.path ?? "").replace(/[^/]*$/, "");
      // One folder with nothing beside it is no choice.
      if (answer.entries.length === 1 && only?.kind === "folder") {
        this.#trail = [only.path];
        await this.#list(only.path);
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.problem = error.problem;
      this.entries = [];
    }
  }
}
