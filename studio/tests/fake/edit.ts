/** The server's part of the editor, reduced: it edits tables instead of text, so comments are lost. */

import { parse, stringify } from "smol-toml";
import { isTable, partsOf, type Json, type TomlTable } from "../../src/edit/keypath";
import type { Edit, Problem } from "../../src/protocol";

export const TEXT = `# A made-up scenario.
format = 1
world = "robots"
name = "Made-up hall"
seed = 1

[map]
box_size_m = 0.5
ascii = """
##########
#........#
#........#
#....#...#
#........#
##########
"""

[sensors.echo]
observations = ["nothing", "wall", "robot"]
[sensors.echo.confusion]
nothing = [0.9, 0.05, 0.05]
wall = [0.1, 0.8, 0.1]
robot = [0.1, 0.1, 0.8]

[[robots]]
name = "couriers"
at = [[2, 1]]
sensors = ["echo"]
regime = "both"
size = 2
`;

const CHAIN = `format = 1
world = "chain"
name = "Made-up snake"
[[obstacles]]
at_m = [1.0, 2.0, 0.5]
radius_m = 0.5
[[obstacles]]
at_m = [-2.0, -1.0, 0.5]
size_m = [1.0, 0.6, 0.8]
[[chains]]
at_m = [0.0, 0.0, 0.0]
[[chains.tasks]]
kind = "reach"
targets_m = [[2.0, 0.0, 1.0]]
`;

const AIRSPACE = `format = 1
world = "airspace"
name = "Made-up super-conflict"
[[airplanes]]
callsign = "ONE1"
at_m = [-4000, 0]
heading_deg = 0
way_points_m = [[4000, 0]]
`;

export function textOf(world: string): string {
  return world === "chain" ? CHAIN : world === "airspace" ? AIRSPACE : TEXT;
}

export const SCHEMA: TomlTable = {
  type: "object",
  description: "A made-up world.",
  properties: {
    format: { type: "integer", description: "Version of the format.", minimum: 1, maximum: 1 },
    world: { type: "string" },
    name: { type: "string", description: "Heading of reports." },
    seed: { type: "integer", description: "All randomness grows from it.", default: 1, minimum: 0 },
    map: { $ref: "#/$defs/Map" },
    sensors: { type: "object", additionalProperties: { $ref: "#/$defs/Sensor" } },
    robots: { anyOf: [{ $ref: "#/$defs/Robot" }, { type: "array", items: { $ref: "#/$defs/Robot" } }] },
    record: {
      type: "object",
      description: "What a run keeps.",
      properties: { events: { type: "boolean", description: "Contacts and doors.", default: true } },
    },
  },
  $defs: {
    Map: {
      type: "object",
      description: "The floor.",
      properties: {
        box_size_m: { type: "number", description: "Side of a box.", minimum: 0, maximum: 1000, default: 0.25 },
        ascii: { type: "string", description: "A drawing." },
      },
    },
    Sensor: {
      type: "object",
      properties: {
        observations: { type: "array", items: { type: "string" } },
        confusion: {
          type: "object",
          description: "Rows sum to 1.",
          additionalProperties: { type: "array", items: { type: "number" } },
        },
      },
    },
    Robot: {
      type: "object",
      description: "Robots of one type.",
      properties: {
        name: { type: "string" },
        count: { anyOf: [{ type: "integer", minimum: 0 }, { type: "null" }], description: "Placed by draw." },
        at: { type: "array", description: "Places.", items: { type: "array", items: { type: "integer" } } },
        size: { type: "integer", description: "Boxes a side.", minimum: 1, maximum: 64, default: 1 },
        period: { type: "integer", description: "Acts every so many cycles.", minimum: 1, default: 1 },
        sensors: { type: "array", items: { type: "string", "x-names": "sensors", examples: ["sonar-ring"] } },
        regime: {
          description: "Whose errors are on.",
          oneOf: [
            { const: "reliable", type: "string", description: "Nobody's." },
            { const: "both", type: "string" },
          ],
        },
        region: { type: "array", items: { type: "integer" } },
      },
    },
  },
};

const KEYS =
  /^(robots|people|doors|obstacles|airplanes|targets_m|format|world|name|seed|count|size|cycles|box_size_m|ascii|observations|nothing|wall|robot|at|sensors|regime|region|events|callsign|at_m|heading_deg|way_points_m|radius_m|ends_m|size_m|kind|goals|repeat|open|closed|periodic|period|behaviour|effector)$/;

function problem(
  cause: string,
  remedy: string,
  at: { line: number; column: number; end: number } | null,
  key: string | null,
): Problem {
  return {
    place: "made-up.toml",
    line: at?.line ?? null,
    column: at?.column ?? null,
    end_line: at?.line ?? null,
    end_column: at?.end ?? null,
    key,
    cause,
    remedy,
    is_warning: false,
  };
}

/** The problems of unknown keys and of rows that do not sum to 1, in the program's words. */
export function check(text: string): Problem[] {
  const lines = text.split("\n");
  const unknown = lines.flatMap((line, i) => {
    const key = /^(\w+)\s*=/.exec(line)?.[1];
    const isWrong = key !== undefined && !KEYS.test(key);
    return isWrong
      ? [
          problem(
            `there is no key \`${key}\``,
            "did you mean `count`?",
            { line: i + 1, column: 1, end: 1 + key.length },
            null,
          ),
        ]
      : [];
  });
  const rows = Object.entries(sensorsOf(text)).flatMap(([name, sensor]) =>
    Object.entries(isTable(sensor) && isTable(sensor["confusion"]) ? sensor["confusion"] : {}).flatMap(
      ([row, values]) => {
        const sum = Array.isArray(values) ? values.reduce<number>((all, one) => all + Number(one), 0) : 1;
        if (Math.abs(sum - 1) < 1e-9) return [];
        const line = lines.findIndex((one) => one.startsWith(`${row} =`));
        return [
          problem(
            `the row sums to ${Number(sum.toPrecision(6))}`,
            "make it 1",
            { line: line + 1, column: row.length + 4, end: (lines[line] ?? "").length + 1 },
            `sensors.${name}.confusion.${row}`,
          ),
        ];
      },
    ),
  );
  return [...unknown, ...rows];
}

function sensorsOf(text: string): TomlTable {
  try {
    const { sensors } = modelOf(text);
    return isTable(sensors) ? sensors : {};
  } catch {
    return {};
  }
}

export function modelOf(text: string): TomlTable {
  return parse(text) as unknown as TomlTable;
}

/** The text with all edits. */
export function edited(text: string, edits: readonly Edit[]): string {
  const model = structuredClone(modelOf(text));
  for (const edit of edits) apply(model, edit);
  return stringify(model);
}

function inside(value: Json, part: string): [Json[] | TomlTable, string] {
  if (isTable(value) || Array.isArray(value)) return [value, part];
  throw problem(`there is nothing at ${part}`, "name another key", null, null);
}

function get(of: Json[] | TomlTable, key: string): Json | undefined {
  return Array.isArray(of) ? of[Number(key)] : of[key];
}

function put(of: Json[] | TomlTable, key: string, value: Json): void {
  if (Array.isArray(of)) of[Number(key)] = value;
  else of[key] = value;
}

/** The table or list that a path ends in, and its last key. */
function ending(model: TomlTable, key: string): [Json[] | TomlTable, string] {
  const parts = partsOf(key);
  let at: Json = model;
  for (const part of parts.slice(0, -1)) {
    const [holder, name] = inside(at, part);
    if (get(holder, name) === undefined) put(holder, name, {});
    at = get(holder, name)!;
  }
  return inside(at, parts.at(-1)!);
}

function apply(model: TomlTable, edit: Edit): void {
  const [of, name] = ending(model, edit.key);
  const now = get(of, name);
  if (edit.op === "set") put(of, name, edit.value as Json);
  else if (edit.op === "remove") Array.isArray(of) ? of.splice(Number(name), 1) : delete of[name];
  else if (edit.op === "insert") {
    const list = Array.isArray(now) ? now : now === undefined ? [] : [now];
    list.splice(edit.at ?? list.length, 0, edit.value as Json);
    put(of, name, list);
  } else if (edit.op === "move" && Array.isArray(of)) of.splice(edit.to, 0, ...of.splice(Number(name), 1));
  else if (edit.op === "rename" && !Array.isArray(of)) {
    const entries = Object.entries(of).map(([key, value]): [string, Json] => [key === name ? edit.to : key, value]);
    for (const key of Object.keys(of)) delete of[key];
    Object.assign(of, Object.fromEntries(entries));
  } else if (edit.op === "paint" && typeof now === "string") {
    const lines = now.split("\n").map((line) => [...line]);
    for (const [row, column, mark] of edit.cells) lines[row]![column] = mark;
    put(of, name, lines.map((line) => line.join("")).join("\n"));
  }
}
