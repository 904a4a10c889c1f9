/** Binary frames: bytes to typed arrays, without a copy. The layout is documented in the server's protocol. */

import { VERSION, type FrameText } from "./protocol";

/** "SSTF" in the order of bytes. */
export const MAGIC = 0x46545353;
/** Bytes before the columns. */
export const HEADER_BYTES = 56;

/** The moving bodies at one cycle. Columns are in the order of the body table. */
export interface Frame {
  session: number;
  tableId: number;
  dimensions: 2 | 3;
  cycle: number;
  time_s: number;
  bodies: number;
  leftOut: number;
  /** x y (z) of each body, in meters. */
  positions_m: Float32Array;
  /** Heading in rad in the plane, a quaternion x y z w in space. */
  orientations: Float32Array;
  /** First point of each line, and the number of all points. */
  lineStarts: Uint32Array;
  points_m: Float32Array;
  /** Velocity of each body in m/s, east, north and up; empty for scenes that are no traffic. */
  velocities_m_s: Float32Array;
  conditions: Uint8Array;
  text: FrameText;
}

/** A frame that cannot be read, with the reason. */
export class FrameError extends Error {}

const NO_TEXT: FrameText = { scans: [], events: [], events_left_out: 0 };

interface Header {
  session: number;
  tableId: number;
  dimensions: 2 | 3;
  hasVelocities: boolean;
  cycle: number;
  time_s: number;
  bodies: number;
  lines: number;
  points: number;
  textBytes: number;
  leftOut: number;
}

function readHeader(bytes: ArrayBuffer): Header {
  if (bytes.byteLength < HEADER_BYTES) {
    throw new FrameError(`a frame of ${bytes.byteLength} bytes is shorter than its header`);
  }
  const view = new DataView(bytes);
  if (view.getUint32(0, true) !== MAGIC) throw new FrameError("these bytes are not a frame");
  const version = view.getUint16(4, true);
  if (version !== VERSION) {
    throw new FrameError(`frames have version ${version}, this page reads ${VERSION}: reload the page`);
  }
  const dimensions = view.getUint8(6);
  if (dimensions !== 2 && dimensions !== 3) throw new FrameError(`a frame with ${dimensions} dimensions`);
  return {
    dimensions,
    hasVelocities: view.getUint8(7) === 1,
    session: view.getUint32(8, true),
    tableId: view.getUint32(12, true),
    cycle: view.getFloat64(16, true),
    time_s: view.getFloat64(24, true),
    bodies: view.getUint32(32, true),
    lines: view.getUint32(36, true),
    points: view.getUint32(40, true),
    textBytes: view.getUint32(44, true),
    leftOut: view.getUint32(48, true),
  };
}

/** The number of bytes that a frame with these counts has. */
function frameBytes(head: Header): number {
  const d = head.dimensions;
  const turn = d === 2 ? 1 : 4;
  const velocities = head.hasVelocities ? 3 * head.bodies : 0;
  const words = head.bodies * (d + turn) + (head.lines + 1) + head.points * d + velocities;
  return HEADER_BYTES + 4 * words + 4 * Math.ceil(head.bodies / 4) + head.textBytes;
}

function checkLines(starts: Uint32Array, points: number): void {
  for (let i = 1; i < starts.length; i++) {
    if (starts[i]! < starts[i - 1]!) throw new FrameError("the lines of a frame are not in order");
  }
  if (starts[starts.length - 1] !== points) throw new FrameError("the lines of a frame do not match its points");
}

/** Reads a frame; its arrays look at `bytes`. */
export function decodeFrame(bytes: ArrayBuffer): Frame {
  const head = readHeader(bytes);
  const wanted = frameBytes(head);
  if (bytes.byteLength !== wanted) {
    throw new FrameError(`a frame of ${bytes.byteLength} bytes where its header says ${wanted}`);
  }
  const d = head.dimensions;
  let at = HEADER_BYTES;
  const floats = (n: number): Float32Array => {
    const column = new Float32Array(bytes, at, n);
    at += 4 * n;
    return column;
  };
  const positions_m = floats(d * head.bodies);
  const orientations = floats((d === 2 ? 1 : 4) * head.bodies);
  const lineStarts = new Uint32Array(bytes, at, head.lines + 1);
  at += 4 * (head.lines + 1);
  checkLines(lineStarts, head.points);
  const points_m = floats(d * head.points);
  const velocities_m_s = floats(head.hasVelocities ? 3 * head.bodies : 0);
  const conditions = new Uint8Array(bytes, at, head.bodies);
  at += 4 * Math.ceil(head.bodies / 4);
  const text = head.textBytes === 0 ? NO_TEXT : readText(new Uint8Array(bytes, at, head.textBytes));
  const { session, tableId: table, cycle, time_s, bodies, leftOut } = head;
  return {
    session,
    tableId: table,
    dimensions: d,
    cycle,
    time_s,
    bodies,
    leftOut,
    positions_m,
    orientations,
    lineStarts,
    points_m,
    velocities_m_s,
    conditions,
    text,
  };
}

function readText(bytes: Uint8Array): FrameText {
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes)) as FrameText;
  } catch {
    throw new FrameError("the text of a frame is not JSON");
  }
}
