/** Completions at a place of a text: keys of its section, or values of its key. */

import { keyOf, partsOf, valueAt, isTable, type Path, type Table } from "./keypath";
import { wordsOf, defaultOf, type World } from "./schema";

export interface Option {
  label: string;
  words: string;
  /** The kind of completion, which decides the text written after it. */
  kind: "key" | "value" | "section";
}

export interface Completion {
  from: number;
  options: Option[];
}

/** The section that a place of the text is in, and whether it lies in a text of several lines. */
function sectionAt(text: string, until: number): { path: string[]; isInText: boolean } {
  let path: string[] = [];
  let fence: string | null = null;
  for (const line of text.slice(0, until).split("\n").slice(0, -1)) {
    const fences: string[] = line.replace(/#.*$/, (comment) => (fence ? comment : "")).match(/"""|'''/g) ?? [];
    for (const one of fences) fence = fence === null ? one : fence === one ? null : fence;
    const header = fence ? null : /^\s*\[\[?([^\]]+)\]\]?/.exec(line);
    if (header) path = partsOf(header[1]!.trim());
  }
  return { path, isInText: fence !== null };
}

/** A place within a line: the keys that lead to it, and the typed part of a key or of a value. */
interface Within {
  path: string[];
  rest: string;
  isValue: boolean;
}

/** The keys of inline tables that are open before the cursor, and the rest of the line. */
function opened(line: string): Within {
  const path: string[] = [];
  const key = /^\s*((?:[\w-]+|"[^"]*")(?:\s*\.\s*(?:[\w-]+|"[^"]*"))*)\s*=\s*/.exec(line);
  if (!key) return { path, rest: line.trimStart(), isValue: false };
  const inner = inValue(line.slice(key[0].length));
  return { path: [...partsOf(key[1]!), ...inner.path], rest: inner.rest, isValue: inner.isValue };
}

/** Returns the way into the innermost open table of a value that is not finished. */
function inValue(value: string): Within {
  const ways: { path: string[]; from: number }[] = [];
  let quote = false;
  for (let i = 0; i < value.length; i++) {
    if (value[i] === '"' && value[i - 1] !== "\\") quote = !quote;
    if (quote) continue;
    if (value[i] === "{" || value[i] === "[") {
      const before = /([\w-]+)\s*=\s*[[\s]*$/.exec(value.slice(ways.at(-1)?.from ?? 0, i));
      ways.push({ path: before && value[i] === "{" ? [before[1]!] : [], from: i + 1 });
    } else if (value[i] === "}" || value[i] === "]") ways.pop();
    else if (value[i] === "," && ways.length > 0) ways.at(-1)!.from = i + 1;
  }
  const path = ways.flatMap((way) => way.path);
  const rest = value.slice(ways.at(-1)?.from ?? 0);
  const inTable = ways.length > 0 && value[lastOpen(value)] === "{";
  if (!inTable) return { path, rest: rest.trimStart(), isValue: true };
  const deeper = /^\s*([\w-]+)\s*=\s*(.*)$/.exec(rest);
  return deeper
    ? { path: [...path, deeper[1]!], rest: deeper[2]!, isValue: true }
    : { path, rest: rest.trimStart(), isValue: false };
}

/** Returns the offset of the innermost bracket that is still open. */
function lastOpen(value: string): number {
  const open: number[] = [];
  [...value].forEach((letter, i) => {
    if (letter === "{" || letter === "[") open.push(i);
    if (letter === "}" || letter === "]") open.pop();
  });
  return open.at(-1) ?? -1;
}

/** Returns the completions at a place of the text. */
export function completionAt(text: string, at: number, world: World, model: Table | null): Completion | null {
  const start = text.lastIndexOf("\n", at - 1) + 1;
  const line = text.slice(start, at);
  const { path, isInText } = sectionAt(text, at);
  if (isInText || /^\s*#/.test(line)) return null;
  const header = /^\s*\[\[?([^\]]*)$/.exec(line);
  if (header) return sections(header[1]!, at, world);
  const { path: inner, rest, isValue } = opened(line);
  if (/#/.test(rest.replace(/"[^"]*"/g, ""))) return null;
  return isValue ? values([...path, ...inner], rest, at, world, model) : keys([...path, ...inner], rest, at, world);
}

function keys(path: Path, typed: string, at: number, world: World): Completion | null {
  const match = /^((?:[\w-]+\.)*)([\w-]*)$/.exec(typed);
  if (!match) return null;
  const whole = [...path, ...partsOf(match[1]!)];
  const schema = world.at(whole);
  if (!schema) return null;
  const options = world.keysOf(schema).map((key): Option => {
    const own = world.at([...whole, key]);
    const usual = defaultOf(own);
    return { label: key, kind: "key", words: `${wordsOf(own)}${usual ? ` [${usual}]` : ""}` };
  });
  return options.length > 0 ? { from: at - match[2]!.length, options } : null;
}

function sections(typed: string, at: number, world: World): Completion | null {
  const cut = typed.lastIndexOf(".") + 1;
  const schema = world.at(partsOf(typed.slice(0, cut)));
  if (!schema) return null;
  const options = world.keysOf(schema).flatMap((key): Option[] => {
    const own = world.at([...partsOf(typed.slice(0, cut)), key]);
    const kind = own ? world.shapeOf(own, undefined).kind : "any";
    const isSection = kind === "table" || kind === "sections" || kind === "named";
    return isSection ? [{ label: keyOf([key]), words: wordsOf(own), kind: "section" }] : [];
  });
  return { from: at - (typed.length - cut), options };
}

function values(path: Path, typed: string, at: number, world: World, model: Table | null): Completion | null {
  const schema = world.at(path);
  if (!schema) return null;
  const begun = /"?([\w.-]*)$/.exec(typed)!;
  const shape = world.shapeOf(schema, undefined);
  const item = shape.kind === "list" ? world.shapeOf(shape.of, undefined) : shape;
  const quoted = (value: string): string => JSON.stringify(value);
  let options: Option[] = [];
  if (item.kind === "choice")
    options = item.choices.map(({ value, words }) => ({ label: quoted(value), words, kind: "value" }));
  if (item.kind === "switch") options = ["true", "false"].map((label) => ({ label, words: "", kind: "value" }));
  if (item.kind === "text")
    options = namesIn(item.names, model).map((name) => ({ label: quoted(name), words: "", kind: "value" }));
  return options.length > 0 ? { from: at - begun[0].length, options } : null;
}

/** Names that can be given: each word is one of them, or a table of the text whose keys are. */
export function namesIn(words: readonly string[], model: Table | null): string[] {
  const names = words.flatMap((word) => {
    if (!word.startsWith("#")) return [word];
    const table = valueAt(model ?? {}, partsOf(word.slice(1)));
    return isTable(table) ? Object.keys(table) : [];
  });
  return [...new Set(names)];
}
