/** The scenarios that the program carries. */

import { RequestError } from "../connection";
import type { GalleryEntry } from "../protocol";
import type { Studio } from "./studio.svelte";

/** The scenarios of one world. */
export interface GalleryWorld {
  world: string;
  entries: GalleryEntry[];
}

export class Gallery {
  worlds = $state.raw<GalleryWorld[]>([]);

  async load(studio: Pick<Studio, "request">): Promise<void> {
    try {
      const answer = await studio.request({ do: "gallery" });
      if (answer.is === "gallery") this.worlds = byWorld(answer.entries);
    } catch (error) {
      // Without a list there is still everything else to open, and the next connection asks again.
      if (!(error instanceof RequestError)) throw error;
    }
  }
}

/** Groups entries by their worlds, both in their order. */
export function byWorld(entries: readonly GalleryEntry[]): GalleryWorld[] {
  const names = [...new Set(entries.map(({ world }) => world))];
  return names.map((world) => ({ world, entries: entries.filter((entry) => entry.world === world) }));
}

/** The address of the picture of a scenario that the program carries. */
export function pictureAddress(name: string): string {
  return `/picture?name=${encodeURIComponent(name)}`;
}
