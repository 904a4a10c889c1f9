/** Pixels of screenshots, counted by color. */

import type { Locator, Page } from "playwright-core";

export type Color = readonly [number, number, number];

/** Returns how many pixels of an element are of each color, up to a distance in each channel. */
export async function countColors(
  page: Page,
  element: Locator,
  colors: readonly Color[],
  distance = 6,
): Promise<number[]> {
  const picture = (await element.screenshot({ animations: "disabled" })).toString("base64");
  return page.evaluate(
    async ({ picture, colors, distance }) => {
      const bytes = Uint8Array.from(atob(picture), (letter) => letter.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      const pen = canvas.getContext("2d")!;
      pen.drawImage(bitmap, 0, 0);
      const { data } = pen.getImageData(0, 0, bitmap.width, bitmap.height);
      const counts = colors.map(() => 0);
      for (let at = 0; at < data.length; at += 4)
        colors.forEach((color, k) => {
          if (color.every((part, channel) => Math.abs(part - data[at + channel]!) <= distance)) counts[k]!++;
        });
      return counts;
    },
    { picture, colors, distance },
  );
}

/** Red, green or blue. */
export type Channel = 0 | 1 | 2;

/** Least difference of a channel from the others that counts as its color: pale colors do, gray does not. */
const MIN_DIFFERENCE = 24;

/** Counts the pixels of an element, as it is shown, in which a channel exceeds both others, as in pale lines of its color. */
export async function countPixels(page: Page, element: Locator, channel: Channel): Promise<number> {
  const png = (await element.screenshot()).toString("base64");
  return page.evaluate(
    async ([data, channel, difference]) => {
      // The page's policy allows no address but its own, so the picture is no `data:` URL.
      const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const canvas = new OffscreenCanvas(image.width, image.height);
      const pen = canvas.getContext("2d")!;
      pen.drawImage(image, 0, 0);
      const pixels = pen.getImageData(0, 0, image.width, image.height).data;
      let count = 0;
      for (let i = 0; i < pixels.length; i += 4) {
        const others = [0, 1, 2].filter((k) => k !== channel).map((k) => pixels[i + k]!);
        if (pixels[i + channel]! - Math.max(...others) >= difference) count++;
      }
      return count;
    },
    [png, channel, MIN_DIFFERENCE] as const,
  );
}
