/** Text and rings over the scene: axes in meters, a scale bar, labels, the selected body. */

import { PlaneCamera, type Camera, type Extent } from "./camera";
import { number } from "../format";
import { planeGrid, roundUp, spaceGrid } from "./grid";
import { css, type Palette } from "./palette";

export interface Label {
  x_px: number;
  y_px: number;
  /** Radius of the body, so that the label does not cover it. */
  radius_px: number;
  words: string;
  /** The ring around selected and hovered bodies. */
  ring: "selected" | "hovered" | null;
}

const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";

/** Words of a special kind of view, in place of axes and scale bar. */
export interface WordLayer {
  /** Changes whenever the words do. */
  readonly key: string;
  draw(pen: CanvasRenderingContext2D): void;
}

export class Overlay {
  readonly canvas: HTMLCanvasElement;
  readonly #pen: CanvasRenderingContext2D;
  #width = 1;
  #height = 1;
  #drawn = "";

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.#pen = canvas.getContext("2d")!;
  }

  resize(width_px: number, height_px: number, ratio: number): void {
    [this.#width, this.#height] = [width_px, height_px];
    this.#drawn = "";
    this.canvas.width = Math.round(width_px * ratio);
    this.canvas.height = Math.round(height_px * ratio);
    this.#pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** Draws only after a change: an unchanged canvas costs the browser nothing. */
  draw(
    camera: Camera,
    extent: Extent,
    labels: readonly Label[],
    palette: Palette,
    layer: WordLayer | null = null,
  ): void {
    const state = JSON.stringify([
      camera.project(0, 0, 0),
      camera.project(1, 2, 3),
      camera.mPerPx,
      extent,
      labels,
      palette.isDark,
      layer?.key,
    ]);
    if (state === this.#drawn) return;
    this.#drawn = state;
    const pen = this.#pen;
    pen.clearRect(0, 0, this.#width, this.#height);
    pen.font = FONT;
    pen.textBaseline = "middle";
    if (layer) layer.draw(pen);
    else if (camera instanceof PlaneCamera) this.#planeAxes(camera, palette);
    else this.#spaceAxes(camera, extent, palette);
    if (!layer) this.#scaleBar(camera, palette);
    pen.font = FONT;
    for (const label of labels) this.#label(label, palette);
  }

  #text(text: string, x: number, y: number, palette: Palette, ink = palette.ink): void {
    const pen = this.#pen;
    pen.lineWidth = 3.5;
    pen.lineJoin = "round";
    pen.strokeStyle = css(palette.free, 0.9);
    pen.strokeText(text, x, y);
    pen.fillStyle = css(ink);
    pen.fillText(text, x, y);
  }

  #planeAxes(camera: PlaneCamera, palette: Palette): void {
    const pen = this.#pen;
    const { xs, ys } = planeGrid(camera, this.#width, this.#height);
    pen.textAlign = "center";
    for (const x of xs) {
      const [px] = camera.project(x, 0);
      if (px > 34 && px < this.#width - 150)
        this.#text(number(withoutNoise(x)), px, this.#height - 9, palette, palette.faint);
    }
    pen.textAlign = "left";
    for (const y of ys) {
      const [, py] = camera.project(0, y);
      if (py > 48 && py < this.#height - 26) this.#text(number(withoutNoise(y)), 5, py, palette, palette.faint);
    }
  }

  #spaceAxes(camera: Camera, extent: Extent, palette: Palette): void {
    const { xs, ys, z, step } = spaceGrid(extent);
    this.#pen.textAlign = "center";
    // Round values only, and none at the end where the axis letter is drawn.
    const every = (list: number[]): number[] => {
      const stride = Math.ceil(list.length / 6);
      return list.slice(1, -1).filter((value) => Math.round(value / step) % stride === 0);
    };
    for (const x of every(xs)) this.#at(camera, [x, ys[0]!, z], number(withoutNoise(x)), palette);
    for (const y of every(ys)) this.#at(camera, [xs[0]!, y, z], number(withoutNoise(y)), palette);
    this.#at(camera, [xs.at(-1)!, ys[0]!, z], "x", palette);
    this.#at(camera, [xs[0]!, ys.at(-1)!, z], "y", palette);
  }

  #at(camera: Camera, [x, y, z]: [number, number, number], text: string, palette: Palette): void {
    const [px, py, inFront] = camera.project(x, y, z);
    if (inFront) this.#text(text, px, py + 9, palette, palette.faint);
  }

  #scaleBar(camera: Camera, palette: Palette): void {
    const pen = this.#pen;
    const length_m = roundUp(60 * camera.mPerPx);
    const length_px = length_m / camera.mPerPx;
    const [x1, y] = [this.#width - 14, this.#height - 12];
    const x0 = x1 - length_px;
    for (const [width, color] of [
      [4, css(palette.free, 0.9)],
      [1.5, css(palette.ink)],
    ] as const) {
      pen.lineWidth = width;
      pen.strokeStyle = color;
      pen.beginPath();
      pen.moveTo(x0, y - 5);
      pen.lineTo(x0, y);
      pen.lineTo(x1, y);
      pen.lineTo(x1, y - 5);
      pen.stroke();
    }
    pen.textAlign = "center";
    const words = length_m >= 1000 ? `${number(length_m / 1000)} km` : `${number(withoutNoise(length_m))} m`;
    this.#text(words, (x0 + x1) / 2, y - 12, palette);
  }

  #label({ x_px, y_px, radius_px, words, ring }: Label, palette: Palette): void {
    const pen = this.#pen;
    const radius = Math.max(11, radius_px + 4);
    if (ring) {
      for (const [width, color] of [
        [5, css(palette.free, 0.85)],
        [2, css(palette.accent)],
      ] as const) {
        pen.lineWidth = width;
        pen.strokeStyle = color;
        pen.setLineDash(ring === "hovered" ? [4, 3] : []);
        pen.beginPath();
        pen.arc(x_px, y_px, radius, 0, 2 * Math.PI);
        pen.stroke();
      }
      pen.setLineDash([]);
    }
    pen.textAlign = "left";
    const away = 0.75 * (ring ? radius : Math.max(6, radius_px)) + 3;
    this.#text(words, x_px + away, y_px - away, palette);
  }
}

/** A multiple of a round step without the noise of binary fractions. */
function withoutNoise(value: number): number {
  return Number(value.toPrecision(10));
}
