/** Numbers are short and have units, and whole numbers are not rounded. */

import { expect, test } from "vitest";
import { number, place, share, short, time, valueText, bodyLabel, withUnit } from "../../src/format";

const S = "\u202f";

test.each([
  [0, "0"],
  [-0, "0"],
  [7, "7"],
  [1234, "1234"],
  [12_345, `12${S}345`],
  [1_234_567, `1${S}234${S}567`],
  [-42, "−42"],
  [0.5, "0.5"],
  [1 / 3, "0.3333"],
  [1234.56, "1235"],
  [99_999.7, `100${S}000`],
  [-2.50001, "−2.5"],
  [0.00012345, "1.23e−4"],
  [1.5e7 + 0.5, "1.5e7"],
  [NaN, "–"],
  [Infinity, "∞"],
  [-Infinity, "−∞"],
])("%s is %s", (value, words) => {
  expect(number(value)).toBe(words);
});

test("units follow a narrow space", () => {
  expect(withUnit(1.25, "m")).toBe(`1.25${S}m`);
  expect(withUnit(3)).toBe("3");
  expect([1, 2].map((value) => withUnit(value, "cycles"))).toEqual([`1${S}cycle`, `2${S}cycles`]);
});

test.each([
  [0.815, `82${S}%`],
  [0.0123, `1.2${S}%`],
  [0, `0${S}%`],
  [1, `100${S}%`],
])("the share %s is %s", (value, words) => {
  expect(share(value)).toBe(words);
});

test.each([
  [0.04, `0.04${S}s`],
  [119.5, `119.5${S}s`],
  [150, `02:30${S}min`],
  [3723, `1:02:03${S}h`],
])("%s s are %s", (value, words) => {
  expect(time(value)).toBe(words);
});

test("labels of axes are short", () => {
  expect([0.5, 20_000, 250_000, 5e6, 7.5e6].map(short)).toEqual(["0.5", `20${S}000`, `250${S}k`, `5${S}M`, `7.5${S}M`]);
});

test("places have as many coordinates as the world", () => {
  expect(place([1, 2.5, 0], 2)).toBe(`(1, 2.5)${S}m`);
  expect(place([1, 2.5, -3], 3)).toBe(`(1, 2.5, −3)${S}m`);
});

test("values of all kinds have a text", () => {
  expect(valueText("none", 2)).toBe("–");
  expect(valueText({ flag: false }, 2)).toBe("no");
  expect(valueText({ number: { value: -12.5, unit: "°" } }, 2)).toBe(`−12.5${S}°`);
  expect(valueText({ body: { kind: "connector", number: 0, part: 7 } }, 3)).toBe("connector 0/7");
  expect(bodyLabel({ kind: "robot", number: 3, part: null })).toBe("robot 3");
});
