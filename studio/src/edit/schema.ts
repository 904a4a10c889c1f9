/** The JSON Schema of a world: type, limits, unit, choices and description of keys. */

import { isTable, valueAt, type Json, type Path, type TomlTable } from "./keypath";

/** A JSON Schema, limited to the keywords that the server writes. */
export type Schema = TomlTable;

export interface Choice {
  value: string;
  words: string;
}

/** The kinds of values that a key can have. */
export type ValueType =
  | { kind: "number"; isWhole: boolean; min: number | null; max: number | null }
  | { kind: "choice"; choices: Choice[] }
  | { kind: "switch" }
  | { kind: "text"; names: string[] }
  | { kind: "list"; of: Schema }
  | { kind: "sections"; of: Schema }
  | { kind: "table"; keys: string[] }
  | { kind: "named"; of: Schema }
  | { kind: "any" };

const ANY_SCHEMA: Schema = {};

function schemas(value: Json | undefined): Schema[] {
  return Array.isArray(value) ? value.filter(isTable) : [];
}

function isNull(schema: Schema): boolean {
  return (
    schema["type"] === "null" ||
    (Array.isArray(schema["enum"]) && schema["enum"].length === 1 && schema["enum"][0] === null)
  );
}

export class WorldSchema {
  readonly root: Schema;

  constructor(root: Schema) {
    this.root = root;
  }

  /** Follows references, and drops null alternatives. */
  resolve(schema: Schema, depth = 0): Schema {
    const reference = schema["$ref"];
    if (typeof reference === "string" && depth < 20) {
      const path = reference
        .replace(/^#\//, "")
        .split("/")
        .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
      const target = valueAt(this.root, path);
      const { $ref: _, ...own } = schema;
      return this.resolve({ ...(isTable(target) ? target : {}), ...own }, depth + 1);
    }
    for (const word of ["allOf", "anyOf", "oneOf"]) {
      const nonNull = schemas(schema[word]).filter((one) => !isNull(one));
      if (nonNull.length !== 1 || depth >= 20) continue;
      const { [word]: _, ...own } = schema;
      return this.resolve({ ...nonNull[0]!, ...own }, depth + 1);
    }
    const type = schema["type"];
    if (!Array.isArray(type)) return schema;
    const nonNull = type.filter((one) => one !== "null");
    return { ...schema, type: nonNull.length === 1 ? nonNull[0]! : nonNull };
  }

  /** The alternatives of a schema; the schema itself if it has none. */
  #alternatives(schema: Schema): Schema[] {
    const found = [...schemas(schema["anyOf"]), ...schemas(schema["oneOf"])].filter((one) => !isNull(one));
    return found.length > 0 ? found.map((one) => this.resolve(one)) : [schema];
  }

  /** The schema at a path, from the first alternative that has the path. */
  at(path: Path): Schema | null {
    let here: Schema[] = [this.resolve(this.root)];
    for (const part of path) {
      here = here
        .flatMap((schema) => this.#alternatives(schema))
        .flatMap((schema) => this.#below(schema, String(part)));
      if (here.length === 0) return null;
    }
    return here[0] ?? null;
  }

  /** The schema of a key of a table, or of an index of a list. */
  below(schema: Schema, part: string): Schema | null {
    return this.#alternatives(this.resolve(schema)).flatMap((one) => this.#below(one, part))[0] ?? null;
  }

  #below(schema: Schema, part: string): Schema[] {
    const properties = schema["properties"];
    if (isTable(properties) && isTable(properties[part])) return [this.resolve(properties[part])];
    if (schema["type"] === "array" || "items" in schema || "prefixItems" in schema) {
      const item = isTable(schema["items"])
        ? schema["items"]
        : (schemas(schema["prefixItems"])[Number(part)] ?? schemas(schema["prefixItems"])[0] ?? ANY_SCHEMA);
      // Keys of a section are also accepted without its index.
      const own = this.resolve(item);
      return /^\d+$/.test(part) ? [own] : this.#alternatives(own).flatMap((one) => this.#below(one, part));
    }
    if (isTable(schema["additionalProperties"])) return [this.resolve(schema["additionalProperties"])];
    for (const [pattern, of] of Object.entries(
      isTable(schema["patternProperties"]) ? schema["patternProperties"] : {},
    )) {
      if (isTable(of) && new RegExp(pattern).test(part)) return [this.resolve(of)];
    }
    return [];
  }

  /** Keys that a table may have, over all alternatives, in the schema's order. */
  keysOf(schema: Schema): string[] {
    const all = this.#alternatives(schema).flatMap((one) =>
      Object.keys(isTable(one["properties"]) ? one["properties"] : {}),
    );
    return [...new Set(all)];
  }

  /** Returns the schema of a table's members with free names, if it may have any. */
  namedOf(schema: Schema): Schema | null {
    for (const one of this.#alternatives(this.resolve(schema))) {
      if (isTable(one["additionalProperties"])) return this.resolve(one["additionalProperties"]);
    }
    return null;
  }

  /** Returns the type of a schema's values; between alternatives the present value decides. */
  typeOf(given: Schema, value: Json | undefined): ValueType {
    const schema = this.resolve(given);
    const choices = choicesOf(schema);
    if (choices) return { kind: "choice", choices };
    const sections = this.#sections(schema);
    if (sections) return { kind: "sections", of: sections };
    const all = this.#alternatives(schema);
    if (all.length === 1 && all[0] !== schema) return this.typeOf({ ...all[0]!, ...descriptionIn(schema) }, value);
    if (all.length > 1) return this.#alternativeType(all, value);
    return this.#plainType(schema);
  }

  /** One table or a list of them: `[robots]` and `[[robots]]`. */
  #sections(schema: Schema): Schema | null {
    for (const one of this.#alternatives(schema)) {
      if (one["type"] !== "array" || !isTable(one["items"])) continue;
      const item = this.resolve(one["items"]);
      if (
        this.keysOf(item).length > 0 &&
        (schema !== one || schema["x-sections"] === true || item["type"] === "object")
      )
        return item;
    }
    return null;
  }

  #alternativeType(all: Schema[], value: Json | undefined): ValueType {
    const matching = all.find((one) => matches(one, value));
    if (value === undefined || !matching) {
      const tables = all.every((one) => one["type"] === "object");
      return tables ? { kind: "table", keys: [...new Set(all.flatMap((one) => this.keysOf(one)))] } : { kind: "any" };
    }
    const shape = this.#plainType(matching);
    const isSimple = shape.kind === "number" || shape.kind === "text" || shape.kind === "switch";
    // A field for one alternative must not exclude the others.
    return isSimple || shape.kind === "list" ? { kind: "any" } : shape;
  }

  #plainType(schema: Schema): ValueType {
    const type = schema["type"];
    if (type === "boolean") return { kind: "switch" };
    if (type === "number" || type === "integer")
      return { kind: "number", isWhole: type === "integer", ...limitsOf(schema) };
    if (type === "string") return { kind: "text", names: namesOf(schema) };
    if (type === "array" || "items" in schema)
      return { kind: "list", of: isTable(schema["items"]) ? this.resolve(schema["items"]) : ANY_SCHEMA };
    const keys = this.keysOf(schema);
    if (keys.length > 0) return { kind: "table", keys };
    if (isTable(schema["additionalProperties"]))
      return { kind: "named", of: this.resolve(schema["additionalProperties"]) };
    return type === "object" ? { kind: "named", of: ANY_SCHEMA } : { kind: "any" };
  }
}

function descriptionIn(schema: Schema): Schema {
  return typeof schema["description"] === "string" ? { description: schema["description"] } : {};
}

function choicesOf(schema: Schema): Choice[] | null {
  if (typeof schema["const"] === "string") return [{ value: schema["const"], words: "" }];
  const listed = schema["enum"];
  if (Array.isArray(listed) && listed.every((one) => typeof one === "string" || one === null)) {
    return listed.filter((one): one is string => typeof one === "string").map((value) => ({ value, words: "" }));
  }
  const all = [...schemas(schema["oneOf"]), ...schemas(schema["anyOf"])].filter((one) => !isNull(one));
  const found = all.flatMap((one) => {
    const words = typeof one["description"] === "string" ? one["description"] : "";
    const values = "const" in one ? [one["const"]] : Array.isArray(one["enum"]) ? one["enum"] : [];
    return values.length > 0 && values.every((value) => typeof value === "string")
      ? values.map((value) => ({ value: value as string, words }))
      : [null];
  });
  return found.length > 0 && found.every((one) => one !== null) ? found : null;
}

function matches(schema: Schema, value: Json | undefined): boolean {
  const type = schema["type"];
  if (isTable(value)) return type === "object";
  if (Array.isArray(value)) return type === "array";
  if (typeof value === "number") return type === "number" || type === "integer";
  return typeof value === type;
}

function limitsOf(schema: Schema): { min: number | null; max: number | null } {
  const limit = (word: string): number | null => (typeof schema[word] === "number" ? schema[word] : null);
  return { min: limit("minimum") ?? limit("exclusiveMinimum"), max: limit("maximum") ?? limit("exclusiveMaximum") };
}

/** Built-in names, and `#` with the table whose keys are names too. */
function namesOf(schema: Schema): string[] {
  const table = schema["x-names"];
  if (typeof table !== "string") return [];
  const builtIn = Array.isArray(schema["examples"])
    ? schema["examples"].filter((one): one is string => typeof one === "string")
    : [];
  return [...builtIn, `#${table}`];
}

/** The description of a schema, or an empty text. */
export function descriptionOf(schema: Schema | null): string {
  return schema && typeof schema["description"] === "string" ? schema["description"] : "";
}

/** The default value of a key, as far as the schema gives it. */
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

/** The unit given by a schema, or by the ending of a key. */
export function unitOf(key: string, schema: Schema | null = null): string {
  if (schema && typeof schema["x-unit"] === "string") return schema["x-unit"];
  return UNITS.find(([end]) => end.test(key))?.[1] ?? "";
}
