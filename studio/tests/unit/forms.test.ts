import { describe, expect, test } from "vitest";
import { diffLines, condense } from "../../src/edit/diff";
import { keyOf, partsOf, sectionsOf, normalizedPath, type TomlTable } from "../../src/edit/keypath";
import { WorldSchema, unitOf } from "../../src/edit/schema";
import {
  probabilitiesOf,
  columnsOf,
  entriesOf,
  unusedName,
  splitKeys,
  readAny,
  readNumber,
  readNumbers,
  rowsOf,
  normalize,
  sumOf,
  valueEdits,
} from "../../src/edit/values";
import { modelOf, SCHEMA, TEXT } from "../fake/edit";

const world = new WorldSchema(SCHEMA);
const model = modelOf(TEXT);

describe("paths of keys", () => {
  test("keys that are not bare are quoted, and read back", () => {
    for (const parts of [
      ["robots", "1", "at", "0"],
      ["kinds", "a.b", "observation"],
      ["x", 'say "so"'],
      ["ä", "b c"],
    ]) {
      expect(partsOf(keyOf(parts))).toEqual(parts);
    }
    expect(keyOf(["kinds", "a.b", "observation"])).toBe('kinds."a.b".observation');
    expect(partsOf("kinds.'a.b'.x")).toEqual(["kinds", "a.b", "x"]);
  });

  test("the index of a single section may be given", () => {
    const alone = { robots: { size: 2 }, doors: [{ at: [[1, 2]] }] };
    expect(normalizedPath(alone, "robots.0.size")).toEqual(["robots", "size"]);
    expect(normalizedPath(alone, "robots.size")).toEqual(["robots", "size"]);
    expect(normalizedPath(alone, "doors.0.at.0.1")).toEqual(["doors", "0", "at", "0", "1"]);
  });

  test("one table counts as a list of one section", () => {
    expect(sectionsOf({ robots: { size: 2 } }, "robots").map(({ path }) => path)).toEqual([["robots"]]);
    expect(sectionsOf(model, "robots").map(({ path }) => path)).toEqual([["robots", 0]]);
  });
});

describe("fields", () => {
  test("types, limits, choices and sections come from the schema", () => {
    const shape = (path: string[], value?: never): unknown => world.typeOf(world.at(path)!, value);
    expect(shape(["seed"])).toEqual({ kind: "number", isWhole: true, min: 0, max: null });
    expect(shape(["robots", "0", "count"])).toEqual({ kind: "number", isWhole: true, min: 0, max: null });
    expect(shape(["robots", "regime"])).toEqual({
      kind: "choice",
      choices: [
        { value: "reliable", words: "Nobody's." },
        { value: "both", words: "" },
      ],
    });
    expect(shape(["record", "events"])).toEqual({ kind: "switch" });
    expect(world.typeOf(world.at(["robots"])!, undefined).kind).toBe("sections");
    expect(world.typeOf(world.at(["sensors"])!, undefined).kind).toBe("named");
    expect(world.typeOf(world.at(["map"])!, undefined)).toEqual({ kind: "table", keys: ["box_size_m", "ascii"] });
    expect(world.at(["sensors", "echo", "confusion", "wall", "1"])).toEqual({ type: "number" });
    expect(world.at(["nowhere"])).toBe(null);
  });

  test("units come from the names of keys", () => {
    expect(["box_size_m", "v_m_s", "heading_deg", "dt_s", "omega_max_deg_s", "seed"].map((key) => unitOf(key))).toEqual(
      ["m", "m/s", "°", "s", "°/s", ""],
    );
  });

  test("an empty field removes the key, an equal value changes nothing", () => {
    expect(valueEdits(["robots", 0, "size"], 3, 2)).toEqual([{ op: "set", key: "robots.0.size", value: 3 }]);
    expect(valueEdits(["robots", 0, "size"], undefined, 2)).toEqual([{ op: "remove", key: "robots.0.size" }]);
    expect(valueEdits(["seed"], undefined, undefined)).toEqual([]);
    expect(valueEdits(["at"], [1, 2], [1, 2])).toEqual([]);
  });

  test("text that cannot be parsed is reported, and yields no edit", () => {
    expect(readNumber("2.5", false)).toEqual({ value: 2.5 });
    expect(readNumber("", false)).toEqual({ value: undefined });
    expect(readNumber("2.5", true)).toEqual({ error: "write a whole number" });
    expect(readNumber("inf", false)).toEqual({ error: "inf can only be entered in the text" });
    expect(readNumbers("0, 22.5 45")).toEqual({ value: [0, 22.5, 45] });
    expect(readNumbers("a, b")).toHaveProperty("error");
    expect(readAny("[0.4, 0.5]")).toEqual({ value: [0.4, 0.5] });
    expect(readAny("fixed")).toEqual({ value: "fixed" });
    expect(readAny("{ a = 1 }")).toHaveProperty("error");
    expect(readAny("null")).toHaveProperty("error");
  });

  test("sections are listed, and plain keys are separated from tables", () => {
    expect(entriesOf(model, world).map(({ words }) => words)).toEqual([
      "Scenario",
      "map",
      "sensors: echo",
      "robots 1: couriers",
    ]);
    const sensor = (model["sensors"] as TomlTable)["echo"] as TomlTable;
    expect(splitKeys(world, world.at(["sensors", "echo"]), sensor)).toEqual({
      plain: ["observations"],
      tables: ["confusion"],
    });
    const robots = world.at(["robots", "0"]);
    expect(splitKeys(world, robots, {}).tables).toEqual([]);
  });

  test("a new name is unused", () => {
    expect(unusedName(["new", "new-2"], "new")).toBe("new-3");
    expect(unusedName([], "new")).toBe("new");
  });
});

describe("rows of numbers", () => {
  test("are recognized by name or number, with the names of their columns", () => {
    expect(rowsOf({ wall: [0.1, 0.9] }, ["c"])).toEqual([{ name: "wall", path: ["c", "wall"], values: [0.1, 0.9] }]);
    expect(
      rowsOf(
        [
          [1, 2],
          [3, 4],
        ],
        ["at"],
      )?.map(({ name }) => name),
    ).toEqual(["1", "2"]);
    expect(rowsOf([1, 2], ["at"])).toBe(null);
    expect(rowsOf({ a: "b" }, [])).toBe(null);
    expect(probabilitiesOf([{ p: 0.9, path: "F" }, { p: 0.1 }])).toEqual([
      { p: 0.9, rest: { path: "F" } },
      { p: 0.1, rest: {} },
    ]);
    expect(probabilitiesOf([{ path: "F" }])).toBe(null);
    expect(columnsOf(model, ["sensors", "echo", "confusion"], 3)).toEqual(["nothing", "wall", "robot"]);
    expect(columnsOf(model, ["sensors", "echo", "confusion"], 2)).toEqual(["1", "2"]);
  });

  test("a scaled row sums to exactly 1 and keeps its proportions", () => {
    expect(normalize([0.3, 0.3, 0.3])).toEqual([0.333334, 0.333333, 0.333333]);
    expect(normalize([2, 1, 1])).toEqual([0.5, 0.25, 0.25]);
    expect(normalize([0, 0])).toBe(null);
    expect(normalize([1, -0.5])).toBe(null);
    for (let n = 2; n < 40; n++) {
      const row = normalize(Array.from({ length: n }, (_, i) => 1 + ((7 * i) % 5)))!;
      expect(sumOf(row)).toBe(1);
    }
  });
});

describe("differences", () => {
  test("contain the lines of only one text, with some context", () => {
    const mine = Array.from({ length: 20 }, (_, i) => `line ${i}`);
    const theirs = [...mine];
    theirs[10] = "changed";
    theirs.splice(12, 0, "added");
    const lines = diffLines(mine.join("\n"), theirs.join("\n"));
    expect(lines.filter(({ kind }) => kind === "mine").map(({ words }) => words)).toEqual(["line 10"]);
    expect(lines.filter(({ kind }) => kind === "theirs").map(({ words }) => words)).toEqual(["changed", "added"]);
    expect(lines.filter(({ kind }) => kind !== "theirs").map(({ words }) => words)).toEqual(mine);
    const shown = condense(lines);
    expect(shown[0]).toBe(null);
    expect(shown.length).toBeLessThan(12);
  });

  test("equal texts have none", () => {
    expect(diffLines("a\nb", "a\nb").every(({ kind }) => kind === "same")).toBe(true);
    expect(condense(diffLines("a\nb", "a\nb"))).toEqual([null]);
  });
});
