/** A world's schema of a key: its type, limits, unit, choices and meaning. */

import { isTable, valueAt, type Json, type Path, type Table } from "./keypath";

/** A JSON Schema, of the kinds of words that the program writes. */
export type Schema = Table;

export interface Choice {
  value: string;
  words: string;
}

/** The kinds of values that a key can have. */
export type Shape =
  | { kind: "number"; isWhole: boolean; least: number | null; most: number | null }
  | { kind: "choice"; choices: Choice[] }
  | { kind: "switch" }
  | { kind: "text"; names: string[] }
  | { kind: "list"; of: Schema }
  | { kind: "sections"; of: Schema }
  | { kind: "table"; keys: string[] }
  | { kind: "named"; of: Schema }
  | { kind: "any" };

const ANYTHING: Schema = {};

function schemas(value: Json | undefined): Schema[] {
  return Array.isArray(value) ? value.filter(isTable) : [];
}

function isNothing(schema: Schema): boolean {
  return (
    schema["type"] === "null" ||
    (Array.isArray(schema["enum"]) && schema["enum"].length === 1 && schema["enum"][0] === null)
  );
}

export class World {
  readonly root: Schema;

  constructor(root: Schema) {
    this.root = root;
  }

  /** Follows references, and takes away that a value may be absent. */
  resolved(schema: Schema, depth = 0): Schema {
    const reference = schema["$ref"];
    if (typeof reference === "string" && depth < 20) {
      const path = reference
        .replace(/^#\//, "")
        .split("/")
        .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
      const target = valueAt(this.root, path);
      const { $ref: _, ...own } = schema;
      return this.resolved({ ...(isTable(target) ? target : {}), ...own }, depth + 1);
    }
    for (const word of ["allOf", "anyOf", "oneOf"]) {
      const real = schemas(schema[word]).filter((one) => !isNothing(one));
      if (real.length !== 1 || depth >= 20) continue;
      const { [word]: _, ...own } = schema;
      return this.resolved({ ...real[0]!, ...own }, depth + 1);
    }
    const type = schema["type"];
    if (!Array.isArray(type)) return schema;
    const real = type.filter((one) => one !== "null");
    return { ...schema, type: real.length === 1 ? real[0]! : real };
  }

  /** The alternatives of a schema; itself where there is but one. */
  #alternatives(schema: Schema): Schema[] {
    const found = [...schemas(schema["anyOf"]), ...schemas(schema["oneOf"])].filter((one) => !isNothing(one));
    return found.length > 0 ? found.map((one) => this.resolved(one)) : [schema];
  }

  /** The schema at a path; of alternatives, that of the first that knows the path. */
  at(path: Path): Schema | null {
    let here: Schema[] = [this.resolved(this.root)];
    for (const part of path) {
      here = here
        .flatMap((schema) => this.#alternatives(schema))
        .flatMap((schema) => this.#below(schema, String(part)));
      if (here.length === 0) return null;
    }
    return here[0] ?? null;
  }

  /** The schema of a key of a table, or of a number of a list. */
  below(schema: Schema, part: string): Schema | null {
    return this.#alternatives(this.resolved(schema)).flatMap((one) => this.#below(one, part))[0] ?? null;
  }

  #below(schema: Schema, part: string): Schema[] {
    const properties = schema["properties"];
    if (isTable(properties) && isTable(properties[part])) return [this.resolved(properties[part])];
    if (schema["type"] === "array" || "items" in schema || "prefixItems" in schema) {
      const item = isTable(schema["items"])
        ? schema["items"]
        : (schemas(schema["prefixItems"])[Number(part)] ?? schemas(schema["prefixItems"])[0] ?? ANYTHING);
      // A section's keys are also known without its number.
      const own = this.resolved(item);
      return /^\d+$/.test(part) ? [own] : this.#alternatives(own).flatMap((one) => this.#below(one, part));
    }
    if (isTable(schema["additionalProperties"])) return [this.resolved(schema["additionalProperties"])];
    for (const [pattern, of] of Object.entries(
      isTable(schema["patternProperties"]) ? schema["patternProperties"] : {},
    )) {
      if (isTable(of) && new RegExp(pattern).test(part)) return [this.resolved(of)];
    }
    return [];
  }

  /** Keys that a table may have, over all its alternatives, in the schema's order. */
  keysOf(schema: Schema): string[] {
    const all = this.#alternatives(schema).flatMap((one) =>
      Object.keys(isTable(one["properties"]) ? one["properties"] : {}),
    );
    return [...new Set(all)];
  }

  /** Returns the schema of a table's members under names of one's own, if it may have any. */
  namedOf(schema: Schema): Schema | null {
    for (const one of this.#alternatives(this.resolved(schema))) {
      if (isTable(one["additionalProperties"])) return this.resolved(one["additionalProperties"]);
    }
    return null;
  }

  /** Returns the shape of values that can stand there; between alternatives the present value decides. */
  shapeOf(given: Schema, value: Json | undefined): Shape {
    const schema = this.resolved(given);
    const choices = choicesOf(schema);
    if (choices) return { kind: "choice", choices };
    const sections = this.#sections(schema);
    if (sections) return { kind: "sections", of: sections };
    const all = this.#alternatives(schema);
    if (all.length === 1 && all[0] !== schema) return this.shapeOf({ ...all[0]!, ...described(schema) }, value);
    if (all.length > 1) return this.#chosen(all, value);
    return this.#plain(schema);
  }

  /** One table or a list of them: `[robots]` and `[[robots]]`. */
  #sections(schema: Schema): Schema | null {
    for (const one of this.#alternatives(schema)) {
      if (one["type"] !== "array" || !isTable(one["items"])) continue;
      const item = this.resolved(one["items"]);
      if (
        this.keysOf(item).length > 0 &&
        (schema !== one || schema["x-sections"] === true || item["type"] === "object")
      )
        return item;
    }
    return null;
  }

  #chosen(all: Schema[], value: Json | undefined): Shape {
    const fitting = all.find((one) => fits(one, value));
    if (value === undefined || !fitting) {
      const tables = all.every((one) => one["type"] === "object");
      return tables ? { kind: "table", keys: [...new Set(all.flatMap((one) => this.keysOf(one)))] } : { kind: "any" };
    }
    const shape = this.#plain(fitting);
    const isSimple = shape.kind === "number" || shape.kind === "text" || shape.kind === "switch";
    // One form of a value must not lock out the others.
    return isSimple || shape.kind === "list" ? { kind: "any" } : shape;
  }

  #plain(schema: Schema): Shape {
    const type = schema["type"];
    if (type === "boolean") return { kind: "switch" };
    if (type === "number" || type === "integer")
      return { kind: "number", isWhole: type === "integer", ...limitsOf(schema) };
    if (type === "string") return { kind: "text", names: namesOf(schema) };
    if (type === "array" || "items" in schema)
      return { kind: "list", of: isTable(schema["items"]) ? this.resolved(schema["items"]) : ANYTHING };
    const keys = this.keysOf(schema);
    if (keys.length > 0) return { kind: "table", keys };
    if (isTable(schema["additionalProperties"]))
      return { kind: "named", of: this.resolved(schema["additionalProperties"]) };
    return type === "object" ? { kind: "named", of: ANYTHING } : { kind: "any" };
  }
}

function described(schema: Schema): Schema {
  return typeof schema["description"] === "string" ? { description: schema["description"] } : {};
}

function choicesOf(schema: Schema): Choice[] | null {
  if (typeof schema["const"] === "string") return [{ value: schema["const"], words: "" }];
  const listed = schema["enum"];
  if (Array.isArray(listed) && listed.every((one) => typeof one === "string" || one === null)) {
    return listed.filter((one): one is string => typeof one === "string").map((value) => ({ value, words: "" }));
  }
  const all = [...schemas(schema["oneOf"]), ...schemas(schema["anyOf"])].filter((one) => !isNothing(one));
  const found = all.flatMap((one) => {
    const words = typeof one["description"] === "string" ? one["description"] : "";
    const values = "const" in one ? [one["const"]] : Array.isArray(one["enum"]) ? one["enum"] : [];
    return values.length > 0 && values.every((value) => typeof value === "string")
      ? values.map((value) => ({ value: value as string, words }))
      : [null];
  });
  return found.length > 0 && found.every((one) => one !== null) ? found : null;
}

function fits(schema: Schema, value: Json | undefined): boolean {
  const type = schema["type"];
  if (isTable(value)) return type === "object";
  if (Array.isArray(value)) return type === "array";
  if (typeof value === "number") return type === "number" || type === "integer";
  return typeof value === type;
}

function limitsOf(schema: Schema): { least: number | null; most: number | null } {
  const limit = (word: string): number | null => (typeof schema[word] === "number" ? schema[word] : null);
  return { least: limit("minimum") ?? limit("exclusiveMinimum"), most: limit("maximum") ?? limit("exclusiveMaximum") };
}

/** Names that are built in, and the table whose keys are names too, with a # before it. */
function namesOf(schema: Schema): string[] {
  const table = schema["x-names"];
  if (typeof table !== "string") return [];
  const builtIn = Array.isArray(schema["examples"])
    ? schema["examples"].filter((one): one is string => typeof one === "string")
    : [];
  return [...builtIn, `#${table}`];
}

/** The description of a schema, or nothing. */
export function wordsOf(schema: Schema | null): string {
  return schema && typeof schema["description"] === "string" ? schema["description"] : "";
}

/** The value that a key has where it is not given, as far as the schema tells it. */
export function defaultOf(schema: Schema | null): string {
  const value = schema?.["default"];
  if (value === undefined || value === null) return "";
  return typeof value === "string" ? value : JSON.stringify(value);
}

const UNITS: [RegExp, string][] = [
  [/_m_s$/, "m/s"],
  [/_deg_s$/, "°/s"],
  [/_bit_s$/, "bit/s"],
  [/_per_s$/, "1/s"],
  [/_deg$/, "°"],
  [/_rad$/, "rad"],
  [/_gib$/, "GiB"],
  [/_m$/, "m"],
  [/_s$/, "s"],
];

/** The unit that a schema or a key's name tells. */
export function unitOf(key: string, schema: Schema | null = null): string {
  if (schema && typeof schema["x-unit"] === "string") return schema["x-unit"];
  return UNITS.find(([end]) => end.test(key))?.[1] ?? "";
}
