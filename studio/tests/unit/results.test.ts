/** Addresses and names of results hold whatever folders and scenarios are called. */

import { expect, test } from "vitest";
import { exportAddress, plainName, reportAddress } from "../../src/state/results";

test("paths are written so that the server reads them as they are", () => {
  expect(reportAddress("runs/a & b/ü%")).toBe("/report?path=runs%2Fa%20%26%20b%2F%C3%BC%25");
  expect(reportAddress("x", "figures")).toBe("/report?path=x&as=figures");
  expect(exportAddress("x", { form: "csv", table: "events" })).toBe("/export?path=x&as=csv&table=events");
  expect(exportAddress("x", { form: "svg", cycle: 0 })).toBe("/export?path=x&as=svg&cycle=0");
});

test("names of files are plain", () => {
  expect(["Made-up hall", "../a/b", "…", "v1.2 (é)"].map(plainName)).toEqual(["Made-up-hall", "a-b", "sidestep", "v1.2"]);
});
