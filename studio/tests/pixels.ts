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
