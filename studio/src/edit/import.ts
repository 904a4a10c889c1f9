/** Foreign files that a scenario names: maps, and sensors and effectors that were learned from logs. */

import type { Edit, FileEntry } from "../protocol";
import { valueAt, type Table } from "./keypath";
import { insert, remove, set } from "./tools/item";

/** Default side of an image's pixels. */
const PIXEL_M = 0.05;

/** A path as a scenario in a folder names it. */
export function relativePath(folder: string, file: string): string {
  if (folder.startsWith("/") !== file.startsWith("/")) return file;
  const [from, to] = [folder, file].map((path) => path.split("/").filter((part) => part !== "" && part !== "."));
  let same = 0;
  while (same < from!.length && same < to!.length - 1 && from![same] === to![same]) same++;
  return [...from!.slice(same).map(() => ".."), ...to!.slice(same)].join("/");
}

/** The folder that paths of a scenario are relative to: that of its file, or the first that was named at start. */
export function folderOf(place: string, first: string): string {
  return place.includes("/") ? place.replace(/\/[^/]*$/, "") || "/" : first;
}

/** Returns whether a scenario of a world can name a file. */
export function isNameable(world: string, { kind, name }: FileEntry): boolean {
  if (world === "robots") return kind === "profile" || (kind === "map" && !name.endsWith(".world"));
  return world === "chain" && kind === "map" && /\.(yaml|yml|world)$/i.test(name);
}

/** The edits by which a scenario names a file, in place of the map that it had. */
export function importEdits(model: Table, world: string, { kind, name }: FileEntry, path: string): Edit[] {
  const gone = (section: string, keys: string[]): Edit[] =>
    keys.filter((key) => valueAt(model, [section, key]) !== undefined).map((key) => remove([section, key]));
  if (kind === "profile") {
    const known = model["profiles"];
    if (!Array.isArray(known)) return [set(["profiles"], [path])];
    return known.includes(path) ? [] : [insert(["profiles"], path)];
  }
  if (world === "chain") {
    const key = name.endsWith(".world") ? "stage" : "map";
    return [
      ...gone("ground", ["corridor", "map", "stage", ...(key === "stage" ? ["unknown"] : [])]),
      set(["ground", key], path),
    ];
  }
  const isImage = /\.(png|pgm)$/i.test(name);
  const hasPixels = valueAt(model, ["map", "resolution_m"]) !== undefined;
  return [
    ...gone("map", ["ascii", "office", "file", ...(isImage ? [] : ["resolution_m"])]),
    set(["map", "file"], path),
    ...(isImage && !hasPixels ? [set(["map", "resolution_m"], PIXEL_M)] : []),
  ];
}
