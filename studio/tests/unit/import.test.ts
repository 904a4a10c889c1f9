/** Paths of imported files are relative to the scenario's folder, and replace earlier ones. */

import { expect, test } from "vitest";
import type { TomlTable } from "../../src/edit/keypath";
import { asksOf, folderOf, importEdits, relativePath, useOf } from "../../src/edit/import";
import { declaredEditing } from "../fake/editing";
import type { FileEntry } from "../../src/protocol";

const entry = (kind: FileEntry["kind"], name: string): FileEntry => ({ kind, name, path: name, about: "" });

test("paths are relative to the folder of the scenario", () => {
  expect(relativePath("scenarios/robots", "examples/hall.yaml")).toBe("../../examples/hall.yaml");
  expect(relativePath("/a/b", "/a/b/c.png")).toBe("c.png");
  expect(relativePath(".", "./c.png")).toBe("c.png");
  expect(relativePath("", "maps/c.png")).toBe("maps/c.png");
  expect(relativePath("a", "/b/c.png")).toBe("/b/c.png");
  expect([folderOf("x/y.toml", "z"), folderOf("y.toml", "z"), folderOf("/y.toml", "z")]).toEqual(["x", "z", "/"]);
});

test("each world accepts its kinds of files", () => {
  const names = (world: string): string[] =>
    [
      entry("map", "a.yaml"),
      entry("map", "b.png"),
      entry("map", "B.JPEG"),
      entry("map", "c.world"),
      entry("profile", "d.toml"),
      entry("scenario", "e.toml"),
    ]
      .filter((one) => useOf(declaredEditing(world), one))
      .map(({ name }) => name);
  expect(names("robots")).toEqual(["a.yaml", "b.png", "B.JPEG", "d.toml"]);
  expect(names("chain")).toEqual(["a.yaml", "c.world"]);
  expect(names("airspace")).toEqual([]);
});

test("a map replaces the previous one, and a profile is added to others", () => {
  const editsFor = (model: TomlTable, world: string, file: FileEntry): ReturnType<typeof importEdits> =>
    importEdits(model, useOf(declaredEditing(world), file)!, file.name);
  const keys = (edits: ReturnType<typeof importEdits>): string[] => edits.map(({ op, key }) => `${op} ${key}`);
  const drawn = { map: { ascii: "##", box_size_m: 0.5, resolution_m: 0.1 } };
  expect(keys(editsFor(drawn, "robots", entry("map", "a.yaml")))).toEqual([
    "remove map.ascii",
    "remove map.resolution_m",
    "set map.file",
  ]);
  expect(keys(editsFor(drawn, "robots", entry("map", "a.png")))).toEqual(["remove map.ascii", "set map.file"]);
  expect(keys(editsFor({ ground: { corridor: {}, unknown: "solid" } }, "chain", entry("map", "a.world")))).toEqual([
    "remove ground.corridor",
    "remove ground.unknown",
    "set ground.stage",
  ]);
  expect(editsFor({}, "robots", entry("profile", "p.toml"))).toEqual([
    { op: "set", key: "profiles", value: ["p.toml"] },
  ]);
  expect(editsFor({ profiles: ["q.toml"] }, "robots", entry("profile", "p.toml"))).toEqual([
    { op: "insert", key: "profiles", at: null, value: "p.toml" },
  ]);
  expect(editsFor({ profiles: ["p.toml"] }, "robots", entry("profile", "p.toml"))).toEqual([]);
});

test("the side of an image's pixels is asked for each time, with the one that the scenario has", () => {
  const use = useOf(declaredEditing("robots"), entry("map", "a.png"))!;
  const asked = asksOf({}, use);
  expect(asked).toEqual([{ key: "map.resolution_m", name: "Side of a pixel", unit: "m", known: null }]);
  expect(asksOf({ map: { resolution_m: 0.1 } }, use)).toMatchObject([{ key: "map.resolution_m", known: 0.1 }]);
  expect(asksOf({}, useOf(declaredEditing("robots"), entry("map", "a.yaml"))!)).toEqual([]);
  const answers = new Map([["map.resolution_m", 0.02]]);
  expect(importEdits({}, use, "a.png", answers).at(-1)).toEqual({ op: "set", key: "map.resolution_m", value: 0.02 });
});
