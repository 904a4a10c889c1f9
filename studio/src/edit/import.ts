/** Foreign files that a scenario uses: maps, and sensors and effectors learned from logs. */

import type { Edit, FileEntry } from "../protocol";
import { valueAt, type TomlTable } from "./keypath";
import { insert, remove, set } from "./tools/item";

/** Default side of an image's pixels. */
const DEFAULT_PIXEL_M = 0.05;

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

/** Returns whether a scenario of a world can use a file. */
export function canImport(world: string, { kind, name }: FileEntry): boolean {
  if (world === "robots") return kind === "profile" || (kind === "map" && !name.endsWith(".world"));
  return world === "chain" && kind === "map" && /\.(yaml|yml|world)$/i.test(name);
}

/** The edits that make a scenario use a file, in place of its map. */
export function importEdits(model: TomlTable, world: string, { kind, name }: FileEntry, path: string): Edit[] {
  const removals = (section: string, keys: string[]): Edit[] =>
    keys.filter((key) => valueAt(model, [section, key]) !== undefined).map((key) => remove([section, key]));
  if (kind === "profile") {
    const known = model["profiles"];
    if (!Array.isArray(known)) return [set(["profiles"], [path])];
    return known.includes(path) ? [] : [insert(["profiles"], path)];
  }
  if (world === "chain") {
    const key = name.endsWith(".world") ? "stage" : "map";
    return [
      ...removals("ground", ["corridor", "map", "stage", ...(key === "stage" ? ["unknown"] : [])]),
      set(["ground", key], path),
    ];
  }
  const isImage = /\.(png|pgm)$/i.test(name);
  const hasPixels = valueAt(model, ["map", "resolution_m"]) !== undefined;
  return [
    ...removals("map", ["ascii", "office", "file", ...(isImage ? [] : ["resolution_m"])]),
    set(["map", "file"], path),
    ...(isImage && !hasPixels ? [set(["map", "resolution_m"], DEFAULT_PIXEL_M)] : []),
  ];
}
