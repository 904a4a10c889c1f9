/** Completions at a position of a text: keys of its section, or values of its key. */

import { keyOf, partsOf, valueAt, isTable, type Path, type TomlTable } from "./keypath";
import { descriptionOf, defaultOf, type WorldSchema } from "./schema";

export interface CompletionOption {
  label: string;
  words: string;
  /** The kind of completion, which determines the inserted text. */
  kind: "key" | "value" | "section";
}

export interface Completion {
  from: number;
  options: CompletionOption[];
}

/** The section at a position of the text, and whether the position is inside a multi-line string. */
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

/** A position within a line: the path of keys to it, and the typed part of a key or a value. */
interface LineContext {
  path: string[];
  rest: string;
  isValue: boolean;
}

/** The context at the end of a line: the open inline tables, and the rest of the line. */
function lineContext(line: string): LineContext {
  const path: string[] = [];
  const key = /^\s*((?:[\w-]+|"[^"]*")(?:\s*\.\s*(?:[\w-]+|"[^"]*"))*)\s*=\s*/.exec(line);
  if (!key) return { path, rest: line.trimStart(), isValue: false };
  const inner = valueContext(line.slice(key[0].length));
  return { path: [...partsOf(key[1]!), ...inner.path], rest: inner.rest, isValue: inner.isValue };
}

/** Returns the path into the innermost open table of an incomplete value. */
function valueContext(value: string): LineContext {
  const scopes: { path: string[]; from: number }[] = [];
  let quote = false;
  for (let i = 0; i < value.length; i++) {
    if (value[i] === '"' && value[i - 1] !== "\\") quote = !quote;
    if (quote) continue;
    if (value[i] === "{" || value[i] === "[") {
      const before = /([\w-]+)\s*=\s*[[\s]*$/.exec(value.slice(scopes.at(-1)?.from ?? 0, i));
      scopes.push({ path: before && value[i] === "{" ? [before[1]!] : [], from: i + 1 });
    } else if (value[i] === "}" || value[i] === "]") scopes.pop();
    else if (value[i] === "," && scopes.length > 0) scopes.at(-1)!.from = i + 1;
  }
  const path = scopes.flatMap((scope) => scope.path);
  const rest = value.slice(scopes.at(-1)?.from ?? 0);
  const inTable = scopes.length > 0 && value[lastOpenBracket(value)] === "{";
  if (!inTable) return { path, rest: rest.trimStart(), isValue: true };
  const deeper = /^\s*([\w-]+)\s*=\s*(.*)$/.exec(rest);
  return deeper
    ? { path: [...path, deeper[1]!], rest: deeper[2]!, isValue: true }
    : { path, rest: rest.trimStart(), isValue: false };
}

/** Returns the offset of the innermost open bracket. */
function lastOpenBracket(value: string): number {
  const open: number[] = [];
  [...value].forEach((letter, i) => {
    if (letter === "{" || letter === "[") open.push(i);
    if (letter === "}" || letter === "]") open.pop();
  });
  return open.at(-1) ?? -1;
}

/** Returns the completions at a position of the text. */
export function completionAt(text: string, at: number, world: WorldSchema, model: TomlTable | null): Completion | null {
  const start = text.lastIndexOf("\n", at - 1) + 1;
  const line = text.slice(start, at);
  const { path, isInText } = sectionAt(text, at);
  if (isInText || /^\s*#/.test(line)) return null;
  const header = /^\s*\[\[?([^\]]*)$/.exec(line);
  if (header) return sections(header[1]!, at, world);
  const { path: inner, rest, isValue } = lineContext(line);
  if (/#/.test(rest.replace(/"[^"]*"/g, ""))) return null;
  return isValue ? values([...path, ...inner], rest, at, world, model) : keys([...path, ...inner], rest, at, world);
}

function keys(path: Path, typed: string, at: number, world: WorldSchema): Completion | null {
  const match = /^((?:[\w-]+\.)*)([\w-]*)$/.exec(typed);
  if (!match) return null;
  const whole = [...path, ...partsOf(match[1]!)];
  const schema = world.at(whole);
  if (!schema) return null;
  const options = world.keysOf(schema).map((key): CompletionOption => {
    const own = world.at([...whole, key]);
    const fallback = defaultOf(own);
    return { label: key, kind: "key", words: `${descriptionOf(own)}${fallback ? ` [${fallback}]` : ""}` };
  });
  return options.length > 0 ? { from: at - match[2]!.length, options } : null;
}

function sections(typed: string, at: number, world: WorldSchema): Completion | null {
  const cut = typed.lastIndexOf(".") + 1;
  const schema = world.at(partsOf(typed.slice(0, cut)));
  if (!schema) return null;
  const options = world.keysOf(schema).flatMap((key): CompletionOption[] => {
    const own = world.at([...partsOf(typed.slice(0, cut)), key]);
    const kind = own ? world.typeOf(own, undefined).kind : "any";
    const isSection = kind === "table" || kind === "sections" || kind === "named";
    return isSection ? [{ label: keyOf([key]), words: descriptionOf(own), kind: "section" }] : [];
  });
  return { from: at - (typed.length - cut), options };
}

function values(path: Path, typed: string, at: number, world: WorldSchema, model: TomlTable | null): Completion | null {
  const schema = world.at(path);
  if (!schema) return null;
  const partial = /"?([\w.-]*)$/.exec(typed)!;
  const shape = world.typeOf(schema, undefined);
  const item = shape.kind === "list" ? world.typeOf(shape.of, undefined) : shape;
  const quoted = (value: string): string => JSON.stringify(value);
  let options: CompletionOption[] = [];
  if (item.kind === "choice")
    options = item.choices.map(({ value, words }) => ({ label: quoted(value), words, kind: "value" }));
  if (item.kind === "switch") options = ["true", "false"].map((label) => ({ label, words: "", kind: "value" }));
  if (item.kind === "text")
    options = namesIn(item.names, model).map((name) => ({ label: quoted(name), words: "", kind: "value" }));
  return options.length > 0 ? { from: at - partial[0].length, options } : null;
}

/** Names to choose from: each word is a name, or `#` and a table of the text whose keys are names. */
export function namesIn(words: readonly string[], model: TomlTable | null): string[] {
  const names = words.flatMap((word) => {
    if (!word.startsWith("#")) return [word];
    const table = valueAt(model ?? {}, partsOf(word.slice(1)));
    return isTable(table) ? Object.keys(table) : [];
  });
  return [...new Set(names)];
}
