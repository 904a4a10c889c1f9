/** Conversion of a field's text to the value of a key, and to the edits that set it. */

import type { Edit } from "../protocol";
import { isTable, keyOf, valueAt, type Json, type Path, type TomlTable } from "./keypath";
import type { Schema, ValueType, WorldSchema } from "./schema";

/** The value parsed from a field (undefined for an empty one), or the reason why it cannot be parsed. */
export type ParsedValue = { value: Json | undefined } | { error: string };

/** Reads a number; an empty field means that the key is absent. */
export function readNumber(text: string, isWhole: boolean): ParsedValue {
  const trimmed = text.trim().replace(",", ".");
  if (trimmed === "") return { value: undefined };
  const value = Number(trimmed);
  if (!Number.isFinite(value))
    return {
      error: /^[+-]?(inf|nan)$/.test(trimmed) ? `${trimmed} can only be entered in the text` : "write a number",
    };
  if (isWhole && !Number.isInteger(value)) return { error: "write a whole number" };
  return { value };
}

/** Reads numbers separated by commas or blanks. */
export function readNumbers(text: string): ParsedValue {
  const parts = text
    .replace(/[[\]]/g, " ")
    .split(/[\s,;]+/)
    .filter((part) => part !== "");
  const values = parts.map(Number);
  if (values.some((value) => !Number.isFinite(value))) return { error: "write numbers with commas between them" };
  return { value: values.length === 0 ? undefined : values };
}

/** Reads any value in JSON syntax; a bare word is a text. */
export function readAny(text: string): ParsedValue {
  const trimmed = text.trim();
  if (trimmed === "") return { value: undefined };
  try {
    const value = JSON.parse(trimmed) as Json;
    return value === null ? { error: "there is no null in a scenario" } : { value };
  } catch {
    return /^[\w-]+$/.test(trimmed)
      ? { value: trimmed }
      : { error: 'write a number, a "text", a [list] or a {"key": value}' };
  }
}

/** Formats a value for a field. */
export function formatValue(value: Json | undefined, shape: ValueType): string {
  if (value === undefined || value === null) return "";
  if (typeof value === "string" && shape.kind !== "any") return value;
  if (Array.isArray(value) && shape.kind === "list" && value.every((one) => typeof one === "number"))
    return value.join(", ");
  return typeof value === "string" && /^[\w-]+$/.test(value) ? value : JSON.stringify(value);
}

/** The edits that set or remove a key. */
export function valueEdits(path: Path, value: Json | undefined, before: Json | undefined): Edit[] {
  if (value === undefined) return before === undefined ? [] : [{ op: "remove", key: keyOf(path) }];
  return JSON.stringify(value) === JSON.stringify(before) ? [] : [{ op: "set", key: keyOf(path), value }];
}

// Rows of numbers.

export interface NumberRow {
  name: string;
  path: Path;
  values: number[];
}

/** A table of rows of numbers, by name or by index; null for anything else. */
export function rowsOf(value: Json | undefined, path: Path): NumberRow[] | null {
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
  return isRight ? (rows as unknown as NumberRow[]) : null;
}

/** Probabilities of a list of tables, such as the actions of an effector; null for anything else. */
export function probabilitiesOf(value: Json | undefined): { p: number; rest: TomlTable }[] | null {
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

/** Returns whether a sum counts as 1. */
export function isNormalized(sum: number): boolean {
  return Math.abs(sum - 1) < 1e-9;
}

/** The row scaled to the sum 1, to six digits; null if that is impossible. */
export function normalize(values: readonly number[]): number[] | null {
  const sum = values.reduce((all, value) => all + value, 0);
  if (!(sum > 0) || values.some((value) => value < 0)) return null;
  const millionths = values.map((value) => Math.round((1e6 * value) / sum));
  const largest = millionths.indexOf(Math.max(...millionths));
  millionths[largest]! += 1_000_000 - millionths.reduce((all, value) => all + value, 0);
  return millionths.map((value) => value / 1e6);
}

/** Names of columns with the same meaning everywhere. */
function defaultColumns(path: Path, count: number): string[] | null {
  const key = String(path.at(-1));
  if (key === "track") return ["t_s", "x_m", "y_m", "altitude_m"].slice(0, count);
  if (key === "at" || key === "goals") return ["column", "row", "heading"].slice(0, count);
  return /_m(_s)?$/.test(key) && count <= 3 ? ["x", "y", "z"].slice(0, count) : null;
}

/** Returns the names of the columns of a row, from sibling keys of its section. */
export function columnsOf(model: TomlTable | null, path: Path, count: number): string[] {
  const known = defaultColumns(path, count);
  if (known) return known;
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
export function areProbabilities(path: Path): boolean {
  return path.some((part) => /confusion|transitions/.test(String(part)));
}

// Sections.

export interface SectionEntry {
  path: Path;
  words: string;
}

/** All sections of a text, as entries to open. */
export function entriesOf(model: TomlTable, world: WorldSchema): SectionEntry[] {
  const entries: SectionEntry[] = [{ path: [], words: "Scenario" }];
  for (const [key, value] of Object.entries(model)) {
    const schema = world.at([key]);
    const shape = schema ? world.typeOf(schema, value) : null;
    if (Array.isArray(value) && value.some(isTable))
      value.forEach((one, i) => entries.push({ path: [key, i], words: sectionTitle(key, i, one) }));
    else if (isTable(value) && shape?.kind === "named" && Object.values(value).every(isTable)) {
      for (const name of Object.keys(value)) entries.push({ path: [key, name], words: `${key}: ${name}` });
    } else if (isTable(value)) entries.push({ path: [key], words: key });
  }
  return entries;
}

function sectionTitle(key: string, index: number, value: Json): string {
  const name = valueAt(value, ["name"]) ?? valueAt(value, ["callsign"]);
  return typeof name === "string" && name !== "" ? `${key} ${index + 1}: ${name}` : `${key} ${index + 1}`;
}

/** Splits the keys of a table into plain values and tables. */
export function splitKeys(
  world: WorldSchema,
  schema: Schema | null,
  value: TomlTable,
): { plain: string[]; tables: string[] } {
  const keys = [...new Set([...(schema ? world.keysOf(schema) : []), ...Object.keys(value)])];
  const isPlain = (key: string): boolean => {
    const now = value[key];
    if (now !== undefined && (isTable(now) || rowsOf(now, []) || probabilitiesOf(now))) return false;
    if (Array.isArray(now)) return !now.some(isTable);
    const own = schema ? world.below(schema, key) : null;
    const kind = own ? world.typeOf(own, now).kind : "any";
    return kind !== "table" && kind !== "named" && kind !== "sections";
  };
  return { plain: keys.filter(isPlain), tables: keys.filter((key) => !isPlain(key)) };
}

/** An unused name for a new table. */
export function unusedName(taken: readonly string[], base: string): string {
  let name = base;
  for (let i = 2; taken.includes(name); i++) name = `${base}-${i}`;
  return name;
}
