/** Records a video of what a view shows: cycle by cycle, in the time of the run and not in that of the machine. */

import { tick } from "svelte";
import type { Session } from "../state/session.svelte";
import type { Viewport } from "../scene/viewport";
import { WebmWriter } from "./webm";

/** Frames per second of a video. */
export const FRAMES_PER_S = 30;
/** Time between two frames that are complete in themselves, from which players can start. */
const KEY_INTERVAL_FRAMES = 2 * FRAMES_PER_S;
/** Maximum number of frames that wait for the encoder. */
const MAX_QUEUED = 4;
/** Bits per pixel and frame: lines and small letters stay sharp. */
const BITS_PER_PIXEL = 0.25;

/** Codecs as encoders and as files name them, the better one first. */
const CODECS = [
  { encoder: "vp09.00.51.08", file: "V_VP9" },
  { encoder: "vp8", file: "V_VP8" },
] as const;

export interface VideoOptions {
  /** First and last cycle. */
  from: number;
  until: number;
  /** Cycles shown per second. */
  cycles_per_s: number;
}

/** Progress of a recording, and whether it shall go on. */
export interface VideoHooks {
  onProgress(fraction: number): void;
  shouldContinue(): boolean;
}

/** The cycles of the frames of a video; the last one is `until`. */
export function cyclesOfVideo({ from, until, cycles_per_s }: VideoOptions): number[] {
  const count = Math.max(1, Math.ceil(((until - from) / cycles_per_s) * FRAMES_PER_S));
  return Array.from({ length: count + 1 }, (_, i) =>
    Math.min(until, Math.floor(from + (i * cycles_per_s) / FRAMES_PER_S)),
  );
}

async function configure(encoder: VideoEncoder, width: number, height: number): Promise<string> {
  for (const { encoder: codec, file } of CODECS) {
    const bitrate = Math.round(width * height * FRAMES_PER_S * BITS_PER_PIXEL);
    const config: VideoEncoderConfig = { codec, width, height, framerate: FRAMES_PER_S, bitrate };
    const { supported } = await VideoEncoder.isConfigSupported(config);
    if (!supported) continue;
    encoder.configure(config);
    return file;
  }
  throw new Error("this browser has no encoder for VP9 or VP8");
}

/** Records a video; null if it was cancelled. */
export async function recordVideo(
  session: Session,
  viewport: Viewport,
  options: VideoOptions,
  hooks: VideoHooks,
): Promise<Blob | null> {
  if (typeof VideoEncoder === "undefined") {
    throw new Error("this browser cannot encode videos: use Chrome, Edge, Firefox 130 or Safari 16.4");
  }
  session.playback.pause();
  const first = viewport.compose();
  // Encoders take even sizes alone.
  const [width, height] = [first.width & ~1, first.height & ~1];
  let writer: WebmWriter | null = null;
  let failure: unknown = null;
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const bytes = new Uint8Array(chunk.byteLength);
      chunk.copyTo(bytes);
      writer?.add(bytes, Math.round(chunk.timestamp / 1000), chunk.type === "key");
    },
    error: (error) => (failure = error),
  });
  try {
    writer = new WebmWriter({ width, height, codec: await configure(encoder, width, height) });
    const cycles = cyclesOfVideo(options);
    for (const [i, cycle] of cycles.entries()) {
      if (failure !== null) throw failure;
      if (!hooks.shouldContinue()) return null;
      const reached = await session.playback.digestAt(cycle);
      if (reached === null || (await session.frames.waitForCycle(reached.cycle)) === null) return null;
      // A new body table reaches the view with the page's next update, and so do values of agents.
      await tick();
      await session.completePicture();
      await tick();
      const timestamp = Math.round((i * 1e6) / FRAMES_PER_S);
      const frame = new VideoFrame(viewport.compose(), { timestamp, visibleRect: { x: 0, y: 0, width, height } });
      encoder.encode(frame, { keyFrame: i % KEY_INTERVAL_FRAMES === 0 });
      frame.close();
      while (encoder.encodeQueueSize > MAX_QUEUED) await new Promise((then) => setTimeout(then, 5));
      hooks.onProgress((i + 1) / cycles.length);
    }
    await encoder.flush();
    if (failure !== null) throw failure;
    return writer.finish(Math.round((cycles.length * 1000) / FRAMES_PER_S));
  } finally {
    if (encoder.state !== "closed") encoder.close();
  }
}
