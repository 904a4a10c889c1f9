/** Frames of a replay, and the bytes that the server would have sent for each; see the server's `replay_page/chunk.rs`. */

import { HEADER_BYTES, MAGIC } from "../decode";
import { VERSION, type FrameText } from "../protocol";
import { ByteReader, decodePlane } from "./plane";

/** A frame without its cycle. */
export interface FrameColumns {
  table: number;
  dimensions: 2 | 3;
  bodies: number;
  /** Places of bodies, then points of lines. */
  places: Float32Array;
  turns: Float32Array;
  lineStarts: Uint32Array;
  /** Velocities of bodies; empty for scenes that are no traffic. */
  velocities: Float32Array;
  conditions: Float32Array;
}

/** Reads the frames of a chunk. */
export function decodeChunk(bytes: Uint8Array, dimensions: 2 | 3): FrameColumns[] {
  const reader = new ByteReader(bytes);
  const frames: FrameColumns[] = [];
  for (let segments = reader.u32(); segments > 0; segments--) readSegment(reader, dimensions, frames);
  return frames;
}

function readSegment(reader: ByteReader, dimensions: 2 | 3, frames: FrameColumns[]): void {
  const [table, times, bodies, lines, points] = [
    reader.u32(),
    reader.u32(),
    reader.u32(),
    reader.u32(),
    reader.u32(),
  ] as const;
  const velocityCount = reader.u32();
  const lineStarts = reader.u32s(lines + 1);
  const placeCount = dimensions * (bodies + points);
  const turnCount = (dimensions === 2 ? 1 : 4) * bodies;
  const places = decodePlane(reader, placeCount, times);
  const turns = decodePlane(reader, turnCount, times);
  const velocities = velocityCount > 0 ? decodePlane(reader, velocityCount, times) : new Float32Array(0);
  const conditions = decodePlane(reader, bodies, times);
  for (let time = 0; time < times; time++) {
    const at = (column: Float32Array, count: number): Float32Array => column.subarray(time * count, (time + 1) * count);
    frames.push({
      table,
      dimensions,
      bodies,
      places: at(places, placeCount),
      turns: at(turns, turnCount),
      lineStarts,
      velocities: at(velocities, velocityCount),
      conditions: at(conditions, bodies),
    });
  }
}

/** What a frame has beside its columns. */
export interface FrameHead {
  session: number;
  cycle: number;
  time_s: number;
  text: FrameText | null;
}

/** The bytes of a frame, as the server would have sent them. */
export function frameBytes(columns: FrameColumns, head: FrameHead): ArrayBuffer {
  const { dimensions, bodies, places, turns, lineStarts, velocities, conditions } = columns;
  const text = head.text === null ? new Uint8Array() : new TextEncoder().encode(JSON.stringify(head.text));
  const ofBodies = dimensions * bodies;
  const lines = lineStarts.length - 1;
  const points = (places.length - ofBodies) / dimensions;
  const words = places.length + turns.length + lineStarts.length + velocities.length;
  const flags = 4 * Math.ceil(bodies / 4);
  const bytes = new ArrayBuffer(HEADER_BYTES + 4 * words + flags + text.length);
  const view = new DataView(bytes);
  view.setUint32(0, MAGIC, true);
  view.setUint16(4, VERSION, true);
  view.setUint8(6, dimensions);
  view.setUint8(7, velocities.length > 0 ? 1 : 0);
  view.setUint32(8, head.session, true);
  view.setUint32(12, columns.table, true);
  view.setFloat64(16, head.cycle, true);
  view.setFloat64(24, head.time_s, true);
  [bodies, lines, points, text.length].forEach((count, i) => view.setUint32(32 + 4 * i, count, true));
  let at = HEADER_BYTES;
  const put = (column: Float32Array | Uint32Array): void => {
    new Uint8Array(bytes, at).set(new Uint8Array(column.buffer, column.byteOffset, column.byteLength));
    at += column.byteLength;
  };
  put(places.subarray(0, ofBodies));
  put(turns);
  put(lineStarts);
  put(places.subarray(ofBodies));
  put(velocities);
  new Uint8Array(bytes, at, bodies).set(conditions);
  new Uint8Array(bytes, at + flags, text.length).set(text);
  return bytes;
}
