/** Opens files, wherever they come from: a list, a drop, or the program itself. */

import { RequestError } from "../connection";
import type { FileEntry } from "../protocol";
import { actionOf, itemsOf, upload, type DropItem } from "./drops";
import { page } from "./page.svelte";
import type { Studio } from "./studio.svelte";

/** Opens a file by its kind. Returns whether something was opened, or is asked. */
export async function openEntry(studio: Studio, entry: FileEntry, seed: number | null = null): Promise<boolean> {
  const action = actionOf(entry);
  switch (action.do) {
    case "open":
      return studio.open({ kind: action.kind, path: entry.path }, seed);
    case "sweep":
      studio.openSweep(entry.path, entry.name);
      return true;
    case "map":
      page.map = entry;
      return true;
    case "refuse":
      studio.onProblem(action.problem);
      return false;
  }
}

/** Words on the files that are being handed over; empty when there are none. */
type OnProgress = (words: string) => void;

/** Opens what was dropped: each file or folder by itself, files beside them go with them. */
export async function openDrop(studio: Studio, transfer: DataTransfer, onProgress: OnProgress): Promise<void> {
  try {
    const items = await itemsOf(transfer);
    for (const item of groupItems(items)) await openItem(studio, item, onProgress);
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    studio.onProblem(error.problem);
  } finally {
    onProgress("");
  }
}

/**
 * The items to open. Of files that are dropped together those that a scenario or a map may name are copied, and only the
 * others opened: a map of ROS comes with its image.
 */
function groupItems(items: DropItem[]): DropItem[] {
  const hasEnding = (endings: RegExp) => (item: DropItem) => endings.test(item.name);
  const leaders = items.filter(hasEnding(/\.(toml|ya?ml|scn)$/i));
  if (leaders.length === 0 || leaders.length === items.length) return items;
  const isFile = ({ files, name }: DropItem): boolean => files.length === 1 && files[0]!.path === name;
  const followers = items.filter((item) => !leaders.includes(item) && isFile(item));
  const others = items.filter((item) => !leaders.includes(item) && !isFile(item));
  const led = leaders.map((leader) => ({
    name: leader.name,
    files: [...followers.flatMap(({ files }) => files), ...leader.files],
  }));
  return [...led, ...others];
}

async function openItem(studio: Studio, item: DropItem, onProgress: OnProgress): Promise<void> {
  onProgress(`Reading ${item.name}…`);
  const { length } = item.files;
  const drop = crypto.getRandomValues(new Uint32Array(2)).join("-");
  const path = await upload(item, drop, (done) => {
    if (length > 1) onProgress(`Reading ${item.name}: ${done} of ${length} files`);
  });
  onProgress(`Opening ${item.name}…`);
  const answer = await studio.request({ do: "identify", path });
  if (answer.is !== "identified") return;
  const { entry } = answer;
  // A copy is gone with the server, so it is not remembered.
  if (entry.path.includes(`/${drop}/`)) studio.copies.add(entry.path);
  await openEntry(studio, entry);
}
