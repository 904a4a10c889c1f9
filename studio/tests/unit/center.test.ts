/** The center shows an existing panel of the active session, regardless of the panel of another one. */

import { expect, test } from "vitest";
import { centerOf, centersOf } from "../../src/state/center";

const [recorded, scenario, fleet] = [
  { isFleet: false, folder: "runs/a" },
  { isFleet: false, folder: null },
  { isFleet: true, folder: null },
];

test("a session without the requested panel shows the view", () => {
  expect([recorded, scenario, fleet].map((one) => centerOf(one, "report"))).toEqual(["report", "view", "view"]);
  expect([recorded, scenario, fleet].map((one) => centerOf(one, "text"))).toEqual(["text", "text", "view"]);
  for (const one of [recorded, scenario, fleet]) expect(centersOf(one)).toContain(centerOf(one, "report"));
});
