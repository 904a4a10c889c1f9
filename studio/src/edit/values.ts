/** Conversion of a field's text to the value of a key, and to the edits that make it so. */

import type { Edit } from "../protocol";
import { isTable, keyOf, valueAt, type Json, type Path, type Table } from "./keypath";
import type { Schema, Shape, World } from "./schema";

/** A value that was read from a field: nothing for an empty one, or the reason why it cannot be read. */
export type Read = { value: Json | undefined } | { wrong: string };

/** Reads a number; an empty field means that the key is not given. */
export function readNumber(text: string, isWhole: boolean): Read {
  const trimmed = text.trim().replace(",", ".");
  if (trimmed === "") return { value: undefined };
  const value = Number(trimmed);
  if (!Number.isFinite(value))
    return {
      wrong: /^[+-]?(inf|nan)$/.test(trimmed) ? `${trimmed} can be written in the text only` : "write a number",
    };
  if (isWhole && !Number.isInteger(value)) return { wrong: "write a whole number" };
  return { value };
}

/** Reads numbers between commas or blanks. */
export function readNumbers(text: string): Read {
  const parts = text
    .replace(/[[\]]/g, " ")
    .split(/[\s,;]+/)
    .filter((part) => part !== "");
  const values = parts.map(Number);
  if (values.some((value) => !Number.isFinite(value))) return { wrong: "write numbers with commas between them" };
  return { value: values.length === 0 ? undefined : values };
}

/** Reads any value as it would stand in JSON; a bare word is a text. */
export function readAny(text: string): Read {
  const trimmed = text.trim();
  if (trimmed === "") return { value: undefined };
  try {
    const value = JSON.parse(trimmed) as Json;
    return value === null ? { wrong: "there is no null in a scenario" } : { value };
  } catch {
    return /^[\w-]+$/.test(trimmed)
      ? { value: trimmed }
      : { wrong: 'write a number, a "text", a [list] or a {"key": value}' };
  }
}

/** Returns a value as a field shows it. */
export function shownValue(value: Json | undefined, shape: Shape): string {
  if (value === undefined || value === null) return "";
  if (typeof value === "string" && shape.kind !== "any") return value;
  if (Array.isArray(value) && shape.kind === "list" && value.every((one) => typeof one === "number"))
    return value.join(", ");
  return typeof value === "string" && /^[\w-]+$/.test(value) ? value : JSON.stringify(value);
}

/** The edit that gives a key a value, or takes it away. */
export function valueEdits(path: Path, value: Json | undefined, before: Json | undefined): Edit[] {
  if (value === undefined) return before === undefined ? [] : [{ op: "remove", key: keyOf(path) }];
  return JSON.stringify(value) === JSON.stringify(before) ? [] : [{ op: "set", key: keyOf(path), value }];
}

// Rows of numbers.

export interface Row {
  name: string;
  path: Path;
  values: number[];
}

/** A table of rows of numbers, by name or by number; null for anything else. */
export function rowsOf(value: Json | undefined, path: Path): Row[] | null {
  const entries: [string | number, Json][] = Array.isArray(value)
    ? value.map((one, i) => [i, one])
    : isTable(value)
      ? Object.entries(value)
      : [];
  const rows = entries.map(([key, row]) => ({
    name: typeof key === "number" ? String(key + 1) : key,
    path: [...path, key],
    values: row,
  }));
  const isRight =
    rows.length > 0 &&
    rows.every(
      ({ values }) => Array.isArray(values) && values.length > 1 && values.every((one) => typeof one === "number"),
    );
  return isRight ? (rows as unknown as Row[]) : null;
}

/** Actions of an effector and the like: tables of one probability each; null for anything else. */
export function chancesOf(value: Json | undefined): { p: number; rest: Table }[] | null {
  if (!Array.isArray(value) || value.length === 0) return null;
  const all = value.map((one) => {
    if (!isTable(one) || typeof one["p"] !== "number") return null;
    const { p, ...rest } = one;
    return { p, rest };
  });
  return all.every((one) => one !== null) ? all : null;
}

export function sumOf(values: readonly number[]): number {
  return Number(values.reduce((sum, value) => sum + value, 0).toPrecision(12));
}

/** Returns whether a row counts as one that sums to 1. */
export function isWhole(sum: number): boolean {
  return Math.abs(sum - 1) < 1e-9;
}

/** The row with the same shares and the sum 1, to six digits; null where there is nothing to scale. */
export function scaled(values: readonly number[]): number[] | null {
  const sum = values.reduce((all, value) => all + value, 0);
  if (!(sum > 0) || values.some((value) => value < 0)) return null;
  const millionths = values.map((value) => Math.round((1e6 * value) / sum));
  const largest = millionths.indexOf(Math.max(...millionths));
  millionths[largest]! += 1_000_000 - millionths.reduce((all, value) => all + value, 0);
  return millionths.map((value) => value / 1e6);
}

/** Columns of places, which mean the same everywhere. */
function usualColumns(path: Path, count: number): string[] | null {
  const key = String(path.at(-1));
  if (key === "track") return ["t_s", "x_m", "y_m", "altitude_m"].slice(0, count);
  if (key === "at" || key === "goals") return ["column", "row", "heading"].slice(0, count);
  return /_m(_s)?$/.test(key) && count <= 3 ? ["x", "y", "z"].slice(0, count) : null;
}

/** Returns the meanings of the columns of a row, as its neighbors in the section tell. */
export function columnsOf(model: Table | null, path: Path, count: number): string[] {
  const usual = usualColumns(path, count);
  if (usual) return usual;
  const section = valueAt(model ?? {}, path.slice(0, path.indexOf("sensors") === 0 ? 2 : -1));
  const key = String(path.at(-1));
  const word =
    key === "distance_confusion"
      ? "distance_classes"
      : path.some((part) => String(part).startsWith("confusion"))
        ? "observations"
        : "";
  const names = word === "" ? undefined : valueAt(section, [word]);
  if (Array.isArray(names) && names.length === count) return names.map(String);
  return Array.from({ length: count }, (_, i) => String(i + 1));
}

/** Returns whether the rows at a path are probabilities. */
export function areShares(path: Path): boolean {
  return path.some((part) => /confusion|transitions/.test(String(part)));
}

// Sections.

export interface Entry {
  path: Path;
  words: string;
}

/** All sections of a text, as a list of entries that can be opened. */
export function entriesOf(model: Table, world: World): Entry[] {
  const entries: Entry[] = [{ path: [], words: "Scenario" }];
  for (const [key, value] of Object.entries(model)) {
    const schema = world.at([key]);
    const shape = schema ? world.shapeOf(schema, value) : null;
    if (Array.isArray(value) && value.some(isTable))
      value.forEach((one, i) => entries.push({ path: [key, i], words: named(key, i, one) }));
    else if (isTable(value) && shape?.kind === "named" && Object.values(value).every(isTable)) {
      for (const name of Object.keys(value)) entries.push({ path: [key, name], words: `${key}: ${name}` });
    } else if (isTable(value)) entries.push({ path: [key], words: key });
  }
  return entries;
}

function named(key: string, index: number, value: Json): string {
  const name = valueAt(value, ["name"]) ?? valueAt(value, ["callsign"]);
  return typeof name === "string" && name !== "" ? `${key} ${index + 1}: ${name}` : `${key} ${index + 1}`;
}

/** Keys of a table that are tables themselves, and those that are plain values. */
export function parted(world: World, schema: Schema | null, value: Table): { plain: string[]; tables: string[] } {
  const keys = [...new Set([...(schema ? world.keysOf(schema) : []), ...Object.keys(value)])];
  const isPlain = (key: string): boolean => {
    const now = value[key];
    if (now !== undefined && (isTable(now) || rowsOf(now, []) || chancesOf(now))) return false;
    if (Array.isArray(now)) return !now.some(isTable);
    const own = schema ? world.below(schema, key) : null;
    const kind = own ? world.shapeOf(own, now).kind : "any";
    return kind !== "table" && kind !== "named" && kind !== "sections";
  };
  return { plain: keys.filter(isPlain), tables: keys.filter((key) => !isPlain(key)) };
}

/** A name for a new table that none has yet. */
export function freeName(taken: readonly string[], wish: string): string {
  let name = wish;
  for (let i = 2; taken.includes(name); i++) name = `${wish}-${i}`;
  return name;
}
