/** Addresses and file names of results are valid for all names of folders and scenarios. */

import { expect, test } from "vitest";
import {
  exportAddress,
  parseFailure,
  findRun,
  safeFileName,
  reportAddress,
  parseRunRequest,
} from "../../src/state/results";

test("paths are encoded in addresses", () => {
  expect(reportAddress("runs/a & b/ü%")).toBe("/report?path=runs%2Fa%20%26%20b%2F%C3%BC%25");
  expect(reportAddress("x", "figures")).toBe("/report?path=x&as=figures");
  expect(exportAddress("x", { form: "csv", table: "events" })).toBe("/export?path=x&as=csv&table=events");
  expect(exportAddress("x", { form: "svg", cycle: 0 })).toBe("/export?path=x&as=svg&cycle=0");
});

test("file names need no quoting", () => {
  expect(["Made-up hall", "../a/b", "…", "v1.2 (é)"].map(safeFileName)).toEqual([
    "Made-up-hall",
    "a-b",
    "sidestep",
    "v1.2",
  ]);
});

test("requests of a report's page are validated, and runs are found by name or number", () => {
  const run = (variant: string, seed: string) => ({
    variant,
    seed,
    failure: "",
    replay: { kind: "scenario", path: "x" },
    values: [],
    outliers: [],
  });
  const runs = [run("n=1", "7"), run("n=1", "8"), run("n=2", "7")];
  const found = (data: unknown) => {
    const wanted = parseRunRequest(data);
    return wanted && findRun(runs, wanted);
  };
  expect(found({ opens: { variant: "n=2", seed: null } })).toBe(runs[2]);
  expect(found({ opens: { variant: "n=1", seed: "8" } })).toBe(runs[1]);
  expect(found({ opens: { variant: "0001" } })).toBe(runs[2]);
  expect(found({ opens: { variant: "0009" } })).toBeUndefined();
  expect([null, 3, "opens", {}, { opens: null }, { opens: { variant: 3 } }].map(found)).toEqual(Array(6).fill(null));
});

test("a failure is parsed from the server's text", () => {
  expect(parseFailure("r", "r/run.json: it is cut off: 3 bytes\nhelp: record it again\n")).toMatchObject({
    place: "r/run.json",
    cause: "it is cut off: 3 bytes",
    remedy: "record it again",
  });
  expect(parseFailure("r", "Only the studio's own page may ask.\n")).toMatchObject({
    place: "r",
    cause: "Only the studio's own page may ask.",
  });
});
