import { beforeEach, expect, test, vi } from "vitest";
import { actionOf, itemsOf, sweepCommand } from "../../src/state/drops";
import { byWorld, pictureAddress } from "../../src/state/gallery.svelte";
import { forget, lastUseText, placeOf, recents, remember, rememberPicture } from "../../src/state/recents";
import { curveStyles, runLabels } from "../../src/charts/runs";
import { bytes } from "../../src/format";
import type { FileEntry, FileKind, OpenTarget } from "../../src/protocol";

const stored = new Map<string, string>();
beforeEach(() => {
  stored.clear();
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => stored.get(key) ?? null,
    setItem: (key: string, value: string) => stored.set(key, value),
  });
});

const OFFICE: OpenTarget = { kind: "scenario", path: "scenarios/office.toml" };
const HALL: OpenTarget = { kind: "shipped", name: "robots/hall" };

test("recent files are sorted by time, each once, and keep their pictures", () => {
  const at = (hour: number) => new Date(2026, 5, 1, hour);
  remember(OFFICE, "Office", at(9));
  rememberPicture(OFFICE, "data:image/webp;base64,AA");
  remember(HALL, "Hall", at(10));
  remember(OFFICE, "Office", at(11));
  expect(recents().map(({ name }) => name)).toEqual(["Office", "Hall"]);
  expect(recents()[0]).toEqual({
    target: OFFICE,
    name: "Office",
    opened: at(11).toISOString(),
    picture: "data:image/webp;base64,AA",
  });
  forget(OFFICE);
  expect(recents().map(({ name }) => name)).toEqual(["Hall"]);
});

test("a picture that is too large, or none, is not kept", () => {
  remember(OFFICE, "Office");
  for (const wrong of [`data:image/webp;base64,${"A".repeat(50_000)}`, "javascript:alert(1)", "data:,"]) {
    rememberPicture(OFFICE, wrong);
    expect(recents()[0]!.picture).toBeUndefined();
  }
});

test("entries of an earlier page and of a broken store are no error", () => {
  stored.set("sidestep.recent", JSON.stringify([{ path: "old" }, null, { target: OFFICE, name: "Office" }]));
  expect(recents().map(({ name }) => name)).toEqual(["Office"]);
  expect(lastUseText(recents()[0]!.opened)).toBe("");
  stored.set("sidestep.recent", "{");
  expect(recents()).toEqual([]);
});

test("times are as brief as can be understood", () => {
  const now = new Date(2026, 5, 10, 15, 30);
  const text = (...parts: [number, number, number, number]) => lastUseText(new Date(...parts).toISOString(), now);
  expect([text(2026, 5, 10, 9), text(2026, 5, 9, 23), text(2026, 4, 2, 9), text(2024, 0, 31, 9)]).toEqual([
    "today 09:00",
    "yesterday 23:00",
    "May 2",
    "Jan 31, 2024",
  ]);
  expect([placeOf(OFFICE), placeOf(HALL), placeOf({ kind: "new", world: "chain" })]).toEqual([
    "scenarios/office.toml",
    "shipped: robots/hall",
    "defaults of chain",
  ]);
});

test("midnight is the first hour of a day", () => {
  const now = new Date(2026, 5, 10, 0, 7);
  expect(lastUseText(new Date(2026, 5, 10, 0, 5).toISOString(), now)).toBe("today 00:05");
  expect(lastUseText(new Date(2026, 5, 9, 0, 0).toISOString(), now)).toBe("yesterday 00:00");
});

/** What a browser hands over, of files and texts. */
function transferOf(...items: { kind: "file" | "string"; entry?: object; name?: string }[]): DataTransfer {
  const files = items.flatMap(({ kind, name }) => (kind === "file" ? [{ name } as File] : []));
  const handed = items.map(({ kind, entry }) => ({ kind, webkitGetAsEntry: () => entry ?? null }));
  return { items: handed, files } as unknown as DataTransfer;
}

test("a text that is dropped with files takes the place of none", async () => {
  const hall = { isDirectory: false, name: "hall.toml", file: (then: (file: File) => void) => then({} as File) };
  const items = await itemsOf(transferOf({ kind: "string" }, { kind: "file", entry: hall, name: "hall.toml" }));
  expect(items).toEqual([{ name: "hall.toml", files: [{ path: "hall.toml", file: {} }] }]);
});

test("a dropped file or folder that cannot be read is named", async () => {
  const gone = new Error("NotFoundError");
  const file = { isDirectory: false, name: "a.toml", file: (_: unknown, fail: (error: Error) => void) => fail(gone) };
  const readEntries = (_: unknown, fail: (error: Error) => void): void => fail(gone);
  const folder = { isDirectory: true, name: "runs", createReader: () => ({ readEntries }) };
  for (const entry of [file, folder])
    await expect(itemsOf(transferOf({ kind: "file", entry, name: entry.name }))).rejects.toMatchObject({
      problem: { place: entry.name, cause: "could not be read" },
    });
});

test("every kind of file is opened as people expect, or they are told what would be right", () => {
  const entry = (kind: FileKind, path: string): FileEntry => ({ kind, path, name: path, about: "" });
  expect(actionOf(entry("scenario", "a.toml"))).toEqual({ do: "open", kind: "scenario" });
  expect(actionOf(entry("foreign", "a.scn"))).toEqual({ do: "open", kind: "scenario" });
  expect(actionOf(entry("run", "runs/a"))).toEqual({ do: "open", kind: "recording" });
  expect(actionOf(entry("recording", "a.mcap"))).toEqual({ do: "open", kind: "recording" });
  expect(actionOf(entry("map", "a.map"))).toEqual({ do: "map" });
  expect(actionOf(entry("sweep", "sweeps/a"))).toEqual({ do: "sweep" });
  const remedies = (["sweep", "profile", "model", "folder"] as const).map((kind) => {
    const action = actionOf(entry(kind, "some/lag.sweep.toml"));
    return action.do === "refuse" ? action.problem.remedy : "";
  });
  expect(remedies[0]).toContain("sidestep sweep some/lag.sweep.toml --out sweeps/lag");
  expect(remedies[1]).toContain("profiles = [");
  expect(remedies[2]).toContain("urdf");
  expect(remedies[3]).toContain("run.json");
  expect(sweepCommand("my sweeps/it's.toml")).toBe("sidestep sweep 'my sweeps/it'\\''s.toml' --out 'sweeps/it'\\''s'");
});

test("the gallery keeps the order of worlds and scenarios", () => {
  const entry = (world: string, name: string) => ({ world, name, title: name, about: "" });
  const worlds = byWorld([entry("b", "b/1"), entry("a", "a/1"), entry("b", "b/2")]);
  expect(worlds.map(({ world, entries }) => [world, entries.map(({ name }) => name)])).toEqual([
    ["b", ["b/1", "b/2"]],
    ["a", ["a/1"]],
  ]);
  expect(pictureAddress("robots/a & b")).toBe("/picture?name=robots%2Fa%20%26%20b");
});

test("runs in one chart have names that tell them apart", () => {
  const run = (name: string, seed: string) => ({ name, seed });
  expect(runLabels([run("A", "1"), run("B", "1")])).toEqual(["A", "B"]);
  expect(runLabels([run("A", "1"), run("A", "2")])).toEqual(["A, seed 1", "A, seed 2"]);
  expect(runLabels([run("A", "1"), run("A", "1")])).toEqual(["1: A, seed 1", "2: A, seed 1"]);
});

test("lines differ in color and in dashes, and a single one has the color of text", () => {
  expect(curveStyles(1, false, "black")).toEqual([{ color: "black", dash: [] }]);
  for (const isDark of [false, true]) {
    const styles = curveStyles(4, isDark, "black");
    expect(new Set(styles.map(({ color }) => color)).size).toBe(4);
    expect(new Set(styles.map(({ dash }) => dash.join())).size).toBe(4);
  }
});

test("amounts of data are short", () => {
  expect([0, 1023, 1024, 1536, 10 << 20, 3 * 2 ** 30].map(bytes).map((text) => text.replace(/\s/, " "))).toEqual([
    "0 B",
    "1023 B",
    "1 KiB",
    "1.5 KiB",
    "10 MiB",
    "3 GiB",
  ]);
});
