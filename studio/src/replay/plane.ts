/** Columns of numbers over time; the layout is documented in the server's `replay_page/plane.rs`. */

const RAW = 0;
const SCALED = 1;

/** Reads numbers from bytes, least significant byte first. */
export class ByteReader {
  readonly #view: DataView;
  readonly bytes: Uint8Array;
  at = 0;

  constructor(bytes: Uint8Array) {
    this.bytes = bytes;
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  u8(): number {
    return this.#view.getUint8(this.at++);
  }

  i8(): number {
    return this.#view.getInt8(this.at++);
  }

  u32(): number {
    this.at += 4;
    return this.#view.getUint32(this.at - 4, true);
  }

  f32(): number {
    this.at += 4;
    return this.#view.getFloat32(this.at - 4, true);
  }

  u32s(count: number): Uint32Array {
    return Uint32Array.from({ length: count }, () => this.u32());
  }
}

/** Reads a plane: the values of all channels, time by time. */
export function decodePlane(reader: ByteReader, channels: number, times: number): Float32Array {
  const values = new Float32Array(channels * times);
  const mode = reader.u8();
  if (mode === RAW) {
    for (let channel = 0; channel < channels; channel++)
      for (let time = 0; time < times; time++) values[time * channels + channel] = reader.f32();
    return values;
  }
  if (mode === SCALED) {
    const step = 2 ** reader.i8();
    const whole = decodeWholeNumbers(reader, channels, times);
    for (let i = 0; i < whole.length; i++) values[i] = whole[i]! * step;
    return values;
  }
  const listed = Float32Array.from({ length: reader.u32() }, () => reader.f32());
  const indices = decodeWholeNumbers(reader, channels, times);
  for (let i = 0; i < indices.length; i++) values[i] = listed[indices[i]!]!;
  return values;
}

/** Undoes a zigzag: 0, -1, 1, -2, 2. */
function unzigzag(number: number): number {
  return (number >>> 1) ^ -(number & 1);
}

function decodeWholeNumbers(reader: ByteReader, channels: number, times: number): Int32Array {
  const order = reader.u8();
  const width = reader.u8();
  const shared = reader.u8() === 1 ? reader.u32s(channels) : new Uint32Array(channels);
  const own = shared.reduce((count, of) => count + (of === 0 ? 1 : 0), 0);
  const firsts = new Int32Array(own);
  let before = 0;
  for (let i = 0; i < own; i++) firsts[i] = before = (before + unzigzag(reader.u32())) | 0;
  const later = times - 1;
  const start = reader.at;
  const bytesPerPlane = own * later;
  reader.at += width * bytesPerPlane;
  const { bytes } = reader;
  const whole = new Int32Array(channels * times);
  let number = 0;
  for (let channel = 0; channel < channels; channel++) {
    if (shared[channel] !== 0) {
      const of = shared[channel]! - 1;
      for (let at = 0; at < whole.length; at += channels) whole[at + channel] = whole[at + of]!;
      continue;
    }
    let value = firsts[number]!;
    let slope = 0;
    whole[channel] = value;
    let byte = start + number * later;
    for (let time = 1; time < times; time++, byte++) {
      let zigzag = bytes[byte]!;
      for (let k = 1; k < width; k++) zigzag |= bytes[byte + k * bytesPerPlane]! << (8 * k);
      slope = ((order === 2 && time > 1 ? slope : 0) + unzigzag(zigzag)) | 0;
      value = (value + slope) | 0;
      whole[time * channels + channel] = value;
    }
    number++;
  }
  return whole;
}
