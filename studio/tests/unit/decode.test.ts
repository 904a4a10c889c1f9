/** Frames are decoded by the layout in the server's protocol, and anything else is refused. */

import { describe, expect, test } from "vitest";
import { decodeFrame, FrameError } from "../../src/decode";
import { encodeFrame, type Columns } from "../fake/encode";

/** A frame of two bodies of the plane and one line of two points, written out by hand. */
const HEX = [
  "53535446", // "SSTF"
  "0300",
  "02",
  "00", // version 3, two dimensions, no velocities
  "07000000",
  "03000000", // session 7, table 3
  "0000000000001440",
  "000000000000e03f", // cycle 5, 0.5 s
  "02000000",
  "01000000",
  "02000000",
  "02000000",
  "04000000",
  "00000000",
  "0000803f",
  "00000040",
  "00004040",
  "00008040", // places (1, 2), (3, 4)
  "0000003f",
  "000000bf", // headings 0.5, -0.5
  "00000000",
  "02000000", // the line has points 0 to 2
  "0000a040",
  "0000c040",
  "0000e040",
  "00000041", // (5, 6), (7, 8)
  "03000000", // touching, plain, padded
  "7b7d", // {}
].join("");

function bytesOf(hex: string): ArrayBuffer {
  return Uint8Array.from(hex.match(/../g)!, (pair) => Number.parseInt(pair, 16)).buffer;
}

const SPACE: Columns = {
  session: 1,
  tableId: 2,
  dimensions: 3,
  cycle: 1e15,
  time_s: 0.02,
  positions_m: [1, 2, 3],
  orientations: [0, 0, 0, 1],
  lines: [],
  conditions: [4],
  leftOut: 9,
};

describe("a frame of the plane", () => {
  const frame = decodeFrame(bytesOf(HEX));

  test("has its numbers", () => {
    expect([frame.session, frame.tableId, frame.dimensions, frame.cycle, frame.time_s]).toEqual([7, 3, 2, 5, 0.5]);
    expect([frame.bodies, frame.leftOut]).toEqual([2, 4]);
  });

  test("has its columns", () => {
    expect([...frame.positions_m]).toEqual([1, 2, 3, 4]);
    expect([...frame.orientations]).toEqual([0.5, -0.5]);
    expect([...frame.lineStarts]).toEqual([0, 2]);
    expect([...frame.points_m]).toEqual([5, 6, 7, 8]);
    expect([...frame.conditions]).toEqual([3, 0]);
    expect(frame.text).toEqual({});
  });

  test("is viewed without a copy", () => {
    const bytes = bytesOf(HEX);
    expect(decodeFrame(bytes).positions_m.buffer).toBe(bytes);
  });
});

test("a frame of space has quaternions, and cycles beyond 32 bits", () => {
  const frame = decodeFrame(encodeFrame(SPACE));
  expect([...frame.orientations]).toEqual([0, 0, 0, 1]);
  expect([...frame.positions_m]).toEqual([1, 2, 3]);
  expect([frame.cycle, frame.leftOut, frame.conditions[0]]).toEqual([1e15, 9, 4]);
  expect(frame.text.scans).toEqual([]);
});

describe("bytes that are no frame are refused", () => {
  test.each([
    ["shorter than a header", HEX.slice(0, 100), /shorter than its header/],
    ["with other magic", `00${HEX.slice(2)}`, /not a frame/],
    ["of another version", HEX.replace("0300", "0400"), /version 4/],
    ["with four dimensions", HEX.replace("030002", "030004"), /4 dimensions/],
    ["cut off at the end", HEX.slice(0, -2), /its header says/],
    ["with bytes too many", `${HEX}00`, /its header says/],
    ["whose text is not JSON", HEX.slice(0, -4) + "ffff", /not JSON/],
    [
      "whose lines do not hold its points",
      HEX.replace("0000000002000000" + "0000a040", "0000000001000000" + "0000a040"),
      /points/,
    ],
  ])("%s", (_, hex, words) => {
    const read = (): unknown => decodeFrame(bytesOf(hex));
    expect(read).toThrow(FrameError);
    expect(read).toThrow(words);
  });

  test("at every length but the right one", () => {
    const whole = encodeFrame(SPACE);
    for (let n = 0; n < whole.byteLength; n++) expect(() => decodeFrame(whole.slice(0, n))).toThrow(FrameError);
  });
});
