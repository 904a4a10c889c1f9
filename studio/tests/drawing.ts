/** Drives the pointer at positions of the world. */

import type { Page } from "playwright-core";

export class PointerDriver {
  readonly #page: Page;

  constructor(page: Page) {
    this.#page = page;
  }

  /** Returns the point of the screen where a place of the world is. */
  async at(x_m: number, y_m: number): Promise<[number, number]> {
    const layer = this.#page.locator("canvas.layer");
    // When panels come or go, the canvas has its new size before the camera is fitted to it.
    await this.#page.waitForFunction(() => {
      const canvas = document.querySelector<HTMLElement>("canvas.layer");
      const [width_px, height_px] = canvas?.dataset.camera?.split(" ").slice(3).map(Number) ?? [];
      return canvas !== null && width_px === canvas.clientWidth && height_px === canvas.clientHeight;
    });
    return layer.evaluate(
      (canvas: HTMLElement, [x, y]) => {
        const [x0, y0, m] = canvas.dataset.camera!.split(" ").map(Number) as [number, number, number];
        const box = canvas.getBoundingClientRect();
        return [box.left + box.width / 2 + (x! - x0) / m, box.top + box.height / 2 - (y! - y0) / m] as [number, number];
      },
      [x_m, y_m],
    );
  }

  async click(x_m: number, y_m: number): Promise<void> {
    await this.#page.mouse.click(...(await this.at(x_m, y_m)));
  }

  /** Presses at the first position, moves over the others, and releases at the last. */
  async drag(...places: [number, number][]): Promise<void> {
    const points = await Promise.all(places.map(([x, y]) => this.at(x, y)));
    await this.#page.mouse.move(...points[0]!);
    await this.#page.mouse.down();
    for (const point of points.slice(1)) await this.#page.mouse.move(...point, { steps: 6 });
    await this.#page.mouse.up();
  }

  async tool(name: string): Promise<void> {
    await this.#page.getByRole("group", { name: "Tools" }).getByRole("button", { name, exact: true }).click();
  }
}
