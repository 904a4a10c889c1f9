/** Opens a map as a new scenario on that floor. */

import { RequestError } from "../connection";
import type { FileEntry } from "../protocol";
import { canvasEditorOf } from "./canvas-editor.svelte";
import { draftOf } from "./draft.svelte";
import { editingOf, type Editing, type FileUse } from "./editing";
import { folderOf, importEdits, relativePath, useOf } from "./import";
import { page } from "../state/page.svelte";
import type { Studio } from "../state/studio.svelte";

/** A world that can use a map, and how. */
export interface MapUse {
  world: string;
  editing: Editing;
  use: FileUse;
}

/** Returns the first world whose scenarios can have a map; null if there is none. */
export async function mapUseOf(studio: Studio, entry: FileEntry): Promise<MapUse | null> {
  for (const world of studio.hello?.worlds ?? []) {
    const answer = await studio.request({ do: "schema", world });
    const editing = editingOf(answer.is === "schema" ? answer.editing : undefined);
    const use = useOf(editing, entry);
    if (use && editing.drawing) return { world, editing, use };
  }
  return null;
}

/** The name of a scenario on a map: that of its file. */
const nameOf = (entry: FileEntry): string => (entry.name.split("/").at(-1) ?? entry.name).replace(/\.\w+$/, "");

/** Opens a new scenario on a map; `answers` are the numbers that the file does not say. Returns whether it is open. */
export async function openOnMap(
  studio: Studio,
  entry: FileEntry,
  { world, editing, use }: MapUse,
  answers: ReadonlyMap<string, number>,
): Promise<boolean> {
  if (!(await studio.open({ kind: "new", world }))) return false;
  const session = studio.active;
  if (!session) return false;
  const draft = draftOf(session);
  await draft.whenLoaded;
  draft.replace((editing.drawing?.text_on_map ?? "").replaceAll("{name}", JSON.stringify(nameOf(entry))));
  const path = relativePath(folderOf(draft.place, await firstFolder(studio)), entry.path);
  await draft.edit(() => importEdits(draft.model ?? {}, use, path, answers));
  page.center = "view";
  page.edits = true;
  await draft.whenChecked;
  await draft.runIfValid();
  // A copy is gone with the server: the text takes its walls, where they are not too many.
  if (studio.copies.has(entry.path)) await canvasEditorOf(draft).inlineMap();
  await draft.whenChecked;
  await draft.runIfValid();
  return true;
}

/** The first folder given at start, from which paths in a new scenario start. */
async function firstFolder(studio: Studio): Promise<string> {
  try {
    const answer = await studio.request({ do: "files", folder: null });
    const first = answer.is === "files" ? answer.entries[0] : undefined;
    return first?.kind === "folder" ? first.path : (first?.path ?? "").replace(/[^/]*$/, "");
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    return "";
  }
}
