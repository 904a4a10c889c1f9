/** Pixels of screenshots and images, counted by color in a browser. */

import type { Locator, Page } from "playwright-core";

export type Color = readonly [number, number, number];
/** Red, green or blue. */
export type Channel = 0 | 1 | 2;

/** Least difference of a channel from the others that counts as its color: pale colors do, gray does not. */
const MIN_DIFFERENCE = 24;

/** A part of an image from its upper right corner on. */
export interface Corner {
  width_px: number;
  height_px: number;
}

/** The pixels that count: those near a color in each channel, or those in which a channel exceeds both others. */
type Rule = { color: Color; max_distance: number } | { channel: Channel; min_difference: number };

/** What is known of an image: its size, its number of colors, and the pixels that each rule counts. */
export interface Reading {
  width: number;
  height: number;
  colors: number;
  counts: number[];
}

/** Reads an image in a page: only counts come back, as all pixels would take longer than counting them. */
function read(page: Page, png: Buffer, rules: readonly Rule[], corner: Corner | null): Promise<Reading> {
  return page.evaluate(
    async ({ base64, rules, corner }) => {
      // The page's policy allows no address but its own, so the picture is no `data:` URL.
      const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const { width, height } = image;
      const pen = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })!;
      pen.drawImage(image, 0, 0);
      const all = pen.getImageData(0, 0, width, height).data;
      const { data } = corner
        ? pen.getImageData(width - corner.width_px, 0, corner.width_px, corner.height_px)
        : { data: all };
      const counts = rules.map((rule) => {
        let count = 0;
        if ("color" in rule) {
          const [r, g, b] = rule.color;
          const limit = rule.max_distance;
          for (let i = 0; i < data.length; i += 4) {
            if (Math.abs(data[i]! - r) > limit) continue;
            if (Math.abs(data[i + 1]! - g) > limit) continue;
            if (Math.abs(data[i + 2]! - b) <= limit) count++;
          }
          return count;
        }
        const [second, third] = [(rule.channel + 1) % 3, (rule.channel + 2) % 3];
        for (let i = 0; i < data.length; i += 4) {
          const value = data[i + rule.channel]! - rule.min_difference;
          if (value >= data[i + second]! && value >= data[i + third]!) count++;
        }
        return count;
      });
      return { width, height, colors: new Set(new Uint32Array(all.buffer)).size, counts };
    },
    { base64: png.toString("base64"), rules, corner },
  );
}

/** Reads an image and counts its pixels near some colors, in all of it or in a corner. */
export function readImage(
  page: Page,
  png: Buffer,
  colors: readonly Color[] = [],
  corner: Corner | null = null,
): Promise<Reading> {
  return read(
    page,
    png,
    colors.map((color) => ({ color, max_distance: 11 })),
    corner,
  );
}

/** Returns how many pixels of an element are of each color, up to a distance in each channel. */
export async function countColors(
  page: Page,
  element: Locator,
  colors: readonly Color[],
  max_distance = 6,
): Promise<number[]> {
  const png = await element.screenshot({ animations: "disabled" });
  const rules = colors.map((color) => ({ color, max_distance }));
  return (await read(page, png, rules, null)).counts;
}

/** Counts the pixels of an element, as it is shown, in which a channel exceeds both others, as in pale lines of its color. */
export async function countPixels(page: Page, element: Locator, channel: Channel): Promise<number> {
  const png = await element.screenshot({ animations: "disabled" });
  const { counts } = await read(page, png, [{ channel, min_difference: MIN_DIFFERENCE }], null);
  return counts[0]!;
}

/** The number of colors of each image of a page, as it was loaded; shades that a lossy format adds count as one. */
export function colorsOfImages(images: Locator): Promise<number[]> {
  return images.evaluateAll((all) =>
    Promise.all(
      all.map(async (one) => {
        const image = one as HTMLImageElement;
        await image.decode();
        const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
        const pen = canvas.getContext("2d")!;
        pen.drawImage(image, 0, 0);
        const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
        const seen = new Set<number>();
        for (let i = 0; i < data.length; i += 4)
          seen.add((data[i]! >> 5) * 64 + (data[i + 1]! >> 5) * 8 + (data[i + 2]! >> 5));
        return seen.size;
      }),
    ),
  );
}

/** The number of pixels of two images that differ by more than a rounding, and the largest difference of a channel. */
export function differenceOf(page: Page, a: Buffer, b: Buffer): Promise<{ pixels: number; largest: number }> {
  return page.evaluate(
    async (pictures) => {
      const [one, other] = await Promise.all(
        pictures.map(async (base64) => {
          const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
          const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
          const pen = new OffscreenCanvas(image.width, image.height).getContext("2d")!;
          pen.drawImage(image, 0, 0);
          return pen.getImageData(0, 0, image.width, image.height);
        }),
      );
      if (one!.width !== other!.width || one!.height !== other!.height) return { pixels: Infinity, largest: 255 };
      let [pixels, largest] = [0, 0];
      for (let i = 0; i < one!.data.length; i += 4) {
        let by = 0;
        for (let k = i; k < i + 3; k++) by = Math.max(by, Math.abs(one!.data[k]! - other!.data[k]!));
        largest = Math.max(largest, by);
        if (by > 1) pixels++;
      }
      return { pixels, largest };
    },
    [a.toString("base64"), b.toString("base64")],
  );
}
