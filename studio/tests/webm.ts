/** Reads videos of the page: their frames, and pictures of them. */

import type { Browser } from "playwright-core";

const SEGMENT = 0x18538067;
const CLUSTER = 0x1f43b675;
const SIMPLE_BLOCK = 0xa3;

/** The number of bytes of a variable-length number by its first byte. */
const lengthOf = (first: number): number => Math.clz32(first) - 23;

/** The number of frames in a file of the page's writer. */
export function framesOf(file: Buffer): number {
  let frames = 0;
  const read = (from: number, until: number): void => {
    for (let at = from; at < until;) {
      const idBytes = lengthOf(file[at]!);
      const id = file.readUIntBE(at, idBytes);
      at += idBytes;
      // The writer has sizes of eight bytes.
      const size = Number(file.readBigUInt64BE(at) & 0x00ff_ffff_ffff_ffffn);
      at += 8;
      if (id === SEGMENT || id === CLUSTER) read(at, at + size);
      if (id === SIMPLE_BLOCK) frames++;
      at += size;
    }
  };
  read(0, file.length);
  return frames;
}

export interface VideoPictures {
  width: number;
  height: number;
  duration_s: number;
  /** The picture at each time: red, green, blue and opacity of each pixel. */
  pictures: number[][];
}

/** The pictures of a video at some times, reduced to a width, as a browser plays it. */
export async function picturesOf(
  browser: Browser,
  file: Buffer,
  times_s: number[],
  width: number,
): Promise<VideoPictures> {
  const player = await browser.newPage();
  const found = await player.evaluate(
    async ([url, times, small]) => {
      const video = document.createElement("video");
      video.src = url;
      await new Promise((then) => (video.onloadeddata = video.onerror = then));
      const canvas = document.createElement("canvas");
      canvas.width = small;
      canvas.height = Math.round((small * video.videoHeight) / video.videoWidth);
      const pen = canvas.getContext("2d")!;
      const pictures: number[][] = [];
      for (const time of times) {
        const sought = new Promise((then) => (video.onseeked = then));
        video.currentTime = time;
        await sought;
        pen.drawImage(video, 0, 0, canvas.width, canvas.height);
        pictures.push([...pen.getImageData(0, 0, canvas.width, canvas.height).data]);
      }
      const { videoWidth, videoHeight, duration } = video;
      return { width: videoWidth, height: videoHeight, duration_s: duration, pictures };
    },
    [`data:video/webm;base64,${file.toString("base64")}`, times_s, width] as const,
  );
  await player.close();
  return found;
}

/** The mean difference of two pictures in a channel. */
export function meanDifference(a: number[], b: number[]): number {
  return a.reduce((sum, value, i) => sum + Math.abs(value - b[i]!), 0) / a.length;
}
