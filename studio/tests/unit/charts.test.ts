/** Each metric is shown by one chart at most. */

import { expect, test } from "vitest";
import { availableMetrics } from "../../src/state/charts";

test("a chart offers what no other chart shows, and its own", () => {
  const names = ["a", "b", "c", "d"].map((key) => ({ key, label: key, unit: "", is_primary: false }));
  expect(availableMetrics(names, ["a", "c"], "c").map(({ key }) => key)).toEqual(["b", "c", "d"]);
});
