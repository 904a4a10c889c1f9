/** Words and rings over the picture: axes in meters, a scale bar, names, the selected body. */

import { PlaneEye, type Eye, type Extent } from "./camera";
import { number } from "../format";
import { planeGrid, roundUp, spaceGrid } from "./grid";
import { css, type Palette } from "./palette";

export interface Label {
  x_px: number;
  y_px: number;
  /** Radius of the body, so that the words stand beside it. */
  radius_px: number;
  words: string;
  /** Selected and hovered bodies are ringed. */
  ring: "selected" | "hovered" | null;
}

const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";

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

  /** Draws the changes since the last time: a canvas that stays costs the browser nothing. */
  draw(eye: Eye, extent: Extent, labels: readonly Label[], palette: Palette): void {
    const state = JSON.stringify([
      eye.project(0, 0, 0),
      eye.project(1, 2, 3),
      eye.mPerPx,
      extent,
      labels,
      palette.isDark,
    ]);
    if (state === this.#drawn) return;
    this.#drawn = state;
    const pen = this.#pen;
    pen.clearRect(0, 0, this.#width, this.#height);
    pen.font = FONT;
    pen.textBaseline = "middle";
    if (eye instanceof PlaneEye) this.#planeAxes(eye, palette);
    else this.#spaceAxes(eye, extent, palette);
    this.#scaleBar(eye, palette);
    for (const label of labels) this.#label(label, palette);
  }

  #words(text: string, x: number, y: number, palette: Palette, ink = palette.ink): void {
    const pen = this.#pen;
    pen.lineWidth = 3.5;
    pen.lineJoin = "round";
    pen.strokeStyle = css(palette.free, 0.9);
    pen.strokeText(text, x, y);
    pen.fillStyle = css(ink);
    pen.fillText(text, x, y);
  }

  #planeAxes(eye: PlaneEye, palette: Palette): void {
    const pen = this.#pen;
    const { xs, ys } = planeGrid(eye, this.#width, this.#height);
    pen.textAlign = "center";
    for (const x of xs) {
      const [px] = eye.project(x, 0);
      if (px > 34 && px < this.#width - 150) this.#words(number(tidy(x)), px, this.#height - 9, palette, palette.faint);
    }
    pen.textAlign = "left";
    for (const y of ys) {
      const [, py] = eye.project(0, y);
      if (py > 48 && py < this.#height - 26) this.#words(number(tidy(y)), 5, py, palette, palette.faint);
    }
  }

  #spaceAxes(eye: Eye, extent: Extent, palette: Palette): void {
    const { xs, ys, z, step } = spaceGrid(extent);
    this.#pen.textAlign = "center";
    // Round ones only, and none where the letter of the axis stands.
    const every = (list: number[]): number[] => {
      const stride = Math.ceil(list.length / 6);
      return list.slice(1, -1).filter((value) => Math.round(value / step) % stride === 0);
    };
    for (const x of every(xs)) this.#at(eye, [x, ys[0]!, z], number(tidy(x)), palette);
    for (const y of every(ys)) this.#at(eye, [xs[0]!, y, z], number(tidy(y)), palette);
    this.#at(eye, [xs.at(-1)!, ys[0]!, z], "x", palette);
    this.#at(eye, [xs[0]!, ys.at(-1)!, z], "y", palette);
  }

  #at(eye: Eye, [x, y, z]: [number, number, number], text: string, palette: Palette): void {
    const [px, py, inFront] = eye.project(x, y, z);
    if (inFront) this.#words(text, px, py + 9, palette, palette.faint);
  }

  #scaleBar(eye: Eye, palette: Palette): void {
    const pen = this.#pen;
    const length_m = roundUp(60 * eye.mPerPx);
    const length_px = length_m / eye.mPerPx;
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
    const words = length_m >= 1000 ? `${number(length_m / 1000)} km` : `${number(tidy(length_m))} m`;
    this.#words(words, (x0 + x1) / 2, y - 12, palette);
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
    this.#words(words, x_px + away, y_px - away, palette);
  }
}

/** A multiple of a round step without the noise of binary fractions. */
function tidy(value: number): number {
  return Number(value.toPrecision(10));
}
