/** Encodes frames by the layout in the server's protocol. */

import { VERSION, type FrameText } from "../../src/protocol";

export interface Columns {
  session: number;
  tableId: number;
  dimensions: 2 | 3;
  cycle: number;
  time_s: number;
  positions_m: number[];
  orientations: number[];
  lines: number[][];
  /** Velocities of bodies, of traffic. */
  velocities_m_s?: number[];
  conditions: number[];
  leftOut?: number;
  text?: FrameText;
}

export function encodeFrame(columns: Columns): ArrayBuffer {
  const d = columns.dimensions;
  const n = columns.conditions.length;
  const text = columns.text ? new TextEncoder().encode(JSON.stringify(columns.text)) : new Uint8Array(0);
  const points = columns.lines.flat();
  const padded = 4 * Math.ceil(n / 4);
  const velocities = columns.velocities_m_s ?? [];
  const words =
    columns.positions_m.length +
    columns.orientations.length +
    columns.lines.length +
    1 +
    points.length +
    velocities.length;
  const bytes = new ArrayBuffer(56 + 4 * words + padded + text.length);
  const view = new DataView(bytes);
  const u32 = (at: number, value: number): void => view.setUint32(at, value, true);
  u32(0, 0x46545353);
  view.setUint16(4, VERSION, true);
  view.setUint8(6, d);
  view.setUint8(7, velocities.length > 0 ? 1 : 0);
  u32(8, columns.session);
  u32(12, columns.tableId);
  view.setFloat64(16, columns.cycle, true);
  view.setFloat64(24, columns.time_s, true);
  [n, columns.lines.length, points.length / d, text.length, columns.leftOut ?? 0].forEach((v, i) => u32(32 + 4 * i, v));
  let at = 56;
  const floats = (values: number[]): void => {
    new Float32Array(bytes, at, values.length).set(values);
    at += 4 * values.length;
  };
  floats(columns.positions_m);
  floats(columns.orientations);
  let first = 0;
  for (const line of [[], ...columns.lines]) {
    first += line.length / d;
    u32(at, first);
    at += 4;
  }
  floats(points);
  floats(velocities);
  new Uint8Array(bytes, at, n).set(columns.conditions);
  new Uint8Array(bytes, at + padded).set(text);
  return bytes;
}
