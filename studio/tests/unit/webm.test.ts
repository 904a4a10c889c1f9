/** Videos: their cycles, and the elements of the file. */

import { expect, test } from "vitest";
import { cyclesOfVideo } from "../../src/video/record";
import { WebmWriter } from "../../src/video/webm";

test("a video has the cycles that are due at its speed, and ends with the last one", () => {
  expect(cyclesOfVideo({ from: 0, until: 4, cycles_per_s: 30 })).toEqual([0, 1, 2, 3, 4]);
  expect(cyclesOfVideo({ from: 10, until: 12, cycles_per_s: 15 })).toEqual([10, 10, 11, 11, 12]);
  expect(cyclesOfVideo({ from: 0, until: 100, cycles_per_s: 1200 })).toEqual([0, 40, 80, 100]);
});

interface Element {
  id: number;
  at: number;
  content: Uint8Array;
}

/** The elements of some bytes, whose sizes are all 8 bytes long. */
function elementsOf(bytes: Uint8Array): Element[] {
  const found: Element[] = [];
  for (let at = 0; at < bytes.length;) {
    const idBytes = Math.clz32(bytes[at]!) - 23;
    const id = bytes.subarray(at, at + idBytes).reduce((value, byte) => value * 256 + byte, 0);
    const sizes = new DataView(bytes.buffer, bytes.byteOffset + at + idBytes, 8);
    expect(sizes.getUint8(0)).toBe(1);
    const size = sizes.getUint32(4);
    const start = at + idBytes + 8;
    found.push({ id, at, content: bytes.subarray(start, start + size) });
    at = start + size;
  }
  return found;
}

test("a file has a header, one track, clusters that begin with key frames, and where they are", async () => {
  const writer = new WebmWriter({ width: 640, height: 480, codec: "V_VP9" });
  writer.add(Uint8Array.of(1, 2, 3), 0, true);
  writer.add(Uint8Array.of(4), 33, false);
  writer.add(Uint8Array.of(5), 67, true);
  writer.add(Uint8Array.of(6), 40_000, false);
  const bytes = new Uint8Array(await writer.finish(40_033).arrayBuffer());
  const [header, segment] = elementsOf(bytes);
  expect([header!.id, segment!.id]).toEqual([0x1a45dfa3, 0x18538067]);
  const parts = elementsOf(segment!.content);
  expect(parts.map(({ id }) => id)).toEqual([0x1549a966, 0x1654ae6b, 0x1f43b675, 0x1f43b675, 0x1f43b675, 0x1c53bb6b]);
  const clusters = parts.slice(2, 5);
  const blocks = clusters.map(({ content }) =>
    elementsOf(content)
      .slice(1)
      .map((block) => [...block.content]),
  );
  expect(blocks).toEqual([
    [
      [0x81, 0, 0, 0x80, 1, 2, 3],
      [0x81, 0, 33, 0, 4],
    ],
    [[0x81, 0, 0, 0x80, 5]],
    [[0x81, 0, 0, 0, 6]],
  ]);
  const positions = elementsOf(parts[5]!.content).map(({ content }) => {
    const track = elementsOf(elementsOf(content)[1]!.content);
    return track[1]!.content.reduce((value, byte) => value * 256 + byte, 0);
  });
  expect(positions).toEqual(clusters.map(({ at }) => at));
});
