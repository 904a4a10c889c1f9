/** A WebM file of one video track, written from encoded frames: EBML elements as matroska.org documents them. */

/** Largest distance of a frame from the start of its cluster: the format has 16 bits for it. */
const MAX_CLUSTER_MS = 30_000;

/** An element: its identifier, and its content. */
type Content = Uint8Array | Content[];

const ID = {
  ebml: 0x1a45dfa3,
  version: 0x4286,
  readVersion: 0x42f7,
  maxIdLength: 0x42f2,
  maxSizeLength: 0x42f3,
  docType: 0x4282,
  docTypeVersion: 0x4287,
  docTypeReadVersion: 0x4285,
  segment: 0x18538067,
  info: 0x1549a966,
  timestampScale: 0x2ad7b1,
  duration: 0x4489,
  muxingApp: 0x4d80,
  writingApp: 0x5741,
  tracks: 0x1654ae6b,
  track: 0xae,
  trackNumber: 0xd7,
  trackUid: 0x73c5,
  trackType: 0x83,
  codec: 0x86,
  video: 0xe0,
  width: 0xb0,
  height: 0xba,
  cluster: 0x1f43b675,
  timestamp: 0xe7,
  simpleBlock: 0xa3,
  cues: 0x1c53bb6b,
  cuePoint: 0xbb,
  cueTime: 0xb3,
  cueTrackPositions: 0xb7,
  cueTrack: 0xf7,
  cueClusterPosition: 0xf1,
} as const;

/** A whole number in as few bytes as it takes, most significant first. */
function unsigned(value: number): Uint8Array {
  const bytes: number[] = [];
  for (let rest = value; rest > 0 || bytes.length === 0; rest = Math.floor(rest / 256)) bytes.unshift(rest % 256);
  return Uint8Array.from(bytes);
}

function text(value: string): Uint8Array {
  return new TextEncoder().encode(value);
}

function float(value: number): Uint8Array {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, value);
  return new Uint8Array(view.buffer);
}

/** The size of an element in 8 bytes, the first of which says so. */
function size(bytes: number): Uint8Array {
  const view = new DataView(new ArrayBuffer(8));
  view.setUint32(0, 0x01000000 + Math.floor(bytes / 2 ** 32));
  view.setUint32(4, bytes % 2 ** 32);
  return new Uint8Array(view.buffer);
}

function lengthOf(content: Content): number {
  return content instanceof Uint8Array ? content.length : content.reduce((sum, one) => sum + lengthOf(one), 0);
}

function element(id: number, ...content: Content[]): Content {
  return [unsigned(id), size(lengthOf(content)), content];
}

function flatten(content: Content, into: Uint8Array[]): Uint8Array[] {
  if (content instanceof Uint8Array) into.push(content);
  else for (const one of content) flatten(one, into);
  return into;
}

export interface VideoFormat {
  width: number;
  height: number;
  /** `V_VP8` or `V_VP9`. */
  codec: string;
}

interface Cluster {
  start_ms: number;
  blocks: Content[];
}

export class WebmWriter {
  readonly #format: VideoFormat;
  readonly #clusters: Cluster[] = [];

  constructor(format: VideoFormat) {
    this.#format = format;
  }

  /** Adds an encoded frame; the first one is a key frame, and frames come in the order of their times. */
  add(bytes: Uint8Array, time_ms: number, isKey: boolean): void {
    const last = this.#clusters.at(-1);
    if (!last || isKey || time_ms - last.start_ms > MAX_CLUSTER_MS) {
      this.#clusters.push({ start_ms: time_ms, blocks: [] });
    }
    const { start_ms, blocks } = this.#clusters.at(-1)!;
    const since_ms = time_ms - start_ms;
    // Track 1, the time since the start of the cluster, and whether it is a key frame.
    const head = Uint8Array.from([0x81, since_ms >> 8, since_ms & 255, isKey ? 0x80 : 0]);
    blocks.push(element(ID.simpleBlock, head, bytes));
  }

  /** The file; `duration_ms` is the time at which the last frame ends. */
  finish(duration_ms: number): Blob {
    const number = (id: number, value: number): Content => element(id, unsigned(value));
    const header = element(
      ID.ebml,
      number(ID.version, 1),
      number(ID.readVersion, 1),
      number(ID.maxIdLength, 4),
      number(ID.maxSizeLength, 8),
      element(ID.docType, text("webm")),
      number(ID.docTypeVersion, 4),
      number(ID.docTypeReadVersion, 2),
    );
    const info = element(
      ID.info,
      number(ID.timestampScale, 1_000_000),
      element(ID.duration, float(duration_ms)),
      element(ID.muxingApp, text("sidestep")),
      element(ID.writingApp, text("sidestep")),
    );
    const { width, height, codec } = this.#format;
    const video = element(ID.video, number(ID.width, width), number(ID.height, height));
    const tracks = element(
      ID.tracks,
      element(
        ID.track,
        number(ID.trackNumber, 1),
        number(ID.trackUid, 1),
        number(ID.trackType, 1),
        element(ID.codec, text(codec)),
        video,
      ),
    );
    const clusters = this.#clusters.map(({ start_ms, blocks }) =>
      element(ID.cluster, number(ID.timestamp, start_ms), blocks),
    );
    let at = lengthOf([info, tracks]);
    const cues = this.#clusters.map(({ start_ms }, i) => {
      const position = element(ID.cueTrackPositions, number(ID.cueTrack, 1), number(ID.cueClusterPosition, at));
      at += lengthOf(clusters[i]!);
      return element(ID.cuePoint, number(ID.cueTime, start_ms), position);
    });
    const segment = element(ID.segment, info, tracks, clusters, element(ID.cues, cues));
    return new Blob(flatten([header, segment], []) as BlobPart[], { type: "video/webm" });
  }
}
