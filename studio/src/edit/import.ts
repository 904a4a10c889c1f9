/** Foreign files that a scenario uses: maps, and sensors and effectors learned from logs. */

import type { Edit, FileEntry } from "../protocol";
import { valueOf, type AskedNumber, type Editing, type FileUse } from "./editing";
import { partsOf, type TomlTable } from "./keypath";
import { insert, remove, set } from "./tools/item";

/** A path relative to the folder of a scenario. */
export function relativePath(folder: string, file: string): string {
  if (folder.startsWith("/") !== file.startsWith("/")) return file;
  const [from, to] = [folder, file].map((path) => path.split("/").filter((part) => part !== "" && part !== "."));
  let same = 0;
  while (same < from!.length && same < to!.length - 1 && from![same] === to![same]) same++;
  return [...from!.slice(same).map(() => ".."), ...to!.slice(same)].join("/");
}

/** The folder that a scenario's paths are relative to: that of its file, or the first one given at start. */
export function folderOf(place: string, first: string): string {
  return place.includes("/") ? place.replace(/\/[^/]*$/, "") || "/" : first;
}

/** The use of a file in scenarios of a world, if they can use it. */
export function useOf(editing: Editing, { kind, name }: FileEntry): FileUse | undefined {
  const lower = name.toLowerCase();
  const fits = ({ endings }: FileUse): boolean => endings.length === 0 || endings.some((end) => lower.endsWith(end));
  return editing.files.find((use) => use.kind === kind && fits(use));
}

/** A number that a file does not say, with the one that the scenario has for the file before it. */
export interface AskedValue extends AskedNumber {
  known: number | null;
}

/** The numbers that a file does not say: asked for each time, because another file may have another scale. */
export function asksOf(model: TomlTable, use: FileUse): AskedValue[] {
  return use.asks.map((ask) => {
    const known = valueOf(model, ask.key);
    return { ...ask, known: typeof known === "number" ? known : null };
  });
}

/**
 * The edits that make a scenario use a file: in place of another, or beside others in a list. `answers` are the numbers
 * that were asked for, by their keys.
 */
export function importEdits(
  model: TomlTable,
  use: FileUse,
  path: string,
  answers: ReadonlyMap<string, number> = new Map(),
): Edit[] {
  const key = partsOf(use.key);
  if (use.is_list) {
    const known = valueOf(model, use.key);
    if (!Array.isArray(known)) return [set(key, [path])];
    return known.includes(path) ? [] : [insert(key, path)];
  }
  const replaced = use.replaces.filter((other) => valueOf(model, other) !== undefined);
  return [
    ...replaced.map((other) => remove(partsOf(other))),
    set(key, path),
    ...[...answers].map(([other, value]) => set(partsOf(other), value)),
  ];
}
