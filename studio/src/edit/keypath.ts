/** Paths of keys, as `--set` takes them: `robots.1.at.0`; keys that are not bare are quoted. */

export type Path = readonly (string | number)[];
export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type TomlTable = { [key: string]: Json };

const BARE = /^[A-Za-z0-9_-]+$/;

/** A path as text. */
export function keyOf(path: Path): string {
  return path
    .map((part) => (typeof part === "number" || BARE.test(part) ? String(part) : JSON.stringify(part)))
    .join(".");
}

/** The parts of a path; parts that look like numbers stay text. */
export function partsOf(key: string): string[] {
  const parts: string[] = [];
  const part = /"((?:[^"\\]|\\.)*)"|'([^']*)'|([^.]+)/g;
  for (const match of key.matchAll(part)) {
    if (match[1] !== undefined) parts.push(unquote(match[1]));
    else parts.push(match[2] ?? match[3]!.trim());
  }
  return parts;
}

function unquote(inner: string): string {
  try {
    return JSON.parse(`"${inner}"`) as string;
  } catch {
    return inner;
  }
}

export function isTable(value: unknown): value is TomlTable {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** The value at a path, if there is one. */
export function valueAt(model: Json | undefined, path: Path): Json | undefined {
  let value: Json | undefined = model;
  for (const part of path) {
    if (Array.isArray(value)) value = value[Number(part)];
    else if (isTable(value)) value = value[String(part)];
    else return undefined;
  }
  return value;
}

/** A path from the server without the index 0 of a section that is a single table. */
export function normalizedPath(model: Json | undefined, key: string): string[] {
  const kept: string[] = [];
  let value: Json | undefined = model;
  for (const part of partsOf(key)) {
    if (part === "0" && isTable(value) && !("0" in value)) continue;
    kept.push(part);
    value = valueAt(value, [part]);
  }
  return kept;
}

/** Returns whether a path is at or below another one. */
export function isWithin(path: Path, of: Path): boolean {
  return path.length >= of.length && of.every((part, i) => String(part) === String(path[i]));
}

/** Sections under a key: one table counts as a list of one. */
export function sectionsOf(model: Json | undefined, key: string): { path: Path; value: TomlTable }[] {
  const value = valueAt(model, [key]);
  if (isTable(value)) return [{ path: [key], value }];
  if (!Array.isArray(value)) return [];
  return value.flatMap((one, i) => (isTable(one) ? [{ path: [key, i], value: one }] : []));
}

/** A list of at least `min` numbers; null for anything else. */
export function numbersOf(value: Json | undefined, min: number): number[] | null {
  const isRight = Array.isArray(value) && value.length >= min && value.every((one) => typeof one === "number");
  return isRight ? (value as number[]) : null;
}
