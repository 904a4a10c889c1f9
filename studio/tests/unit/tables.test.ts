/** Columns that are the same in every row stand above a table, so that it is narrow; nothing is lost. */

import { expect, test } from "vitest";
import { hoistConstantColumns } from "../../src/panels/tables";
import type { FactValue } from "../../src/protocol";

const text = (words: string): FactValue => ({ text: words });

test("a constant column becomes a fact", () => {
  const rows = [
    [text("sonar"), text("0°")],
    [text("sonar"), text("90°")],
  ];
  expect(hoistConstantColumns({ columns: ["sensor", "beam"], rows })).toEqual({
    same: [{ label: "sensor", value: text("sonar") }],
    columns: ["beam"],
    rows: [[text("0°")], [text("90°")]],
  });
});

test("a single row, no row, and rows that are all the same stay a table", () => {
  const one = { columns: ["a"], rows: [[text("x")]] };
  expect(hoistConstantColumns(one)).toEqual({ same: [], ...one });
  expect(hoistConstantColumns({ columns: ["a"], rows: [] })).toEqual({ same: [], columns: ["a"], rows: [] });
  const alike = { columns: ["a"], rows: [[text("x")], [text("x")]] };
  expect(hoistConstantColumns(alike)).toEqual({ same: [], ...alike });
});
