/** Colors of the canvas: the page's own by theme, and the server's appearances adjusted to them. */

import type { Appearance, MarkRole } from "../protocol";

export type Rgb = [number, number, number];

/** Colors that the canvas takes from the page's theme. */
export interface Palette {
  isDark: boolean;
  background: Rgb;
  free: Rgb;
  wall: Rgb;
  unknown: Rgb;
  ink: Rgb;
  faint: Rgb;
  accent: Rgb;
}

const LIGHT: Palette = {
  isDark: false,
  background: [236, 238, 241],
  free: [255, 255, 255],
  wall: [72, 78, 88],
  unknown: [224, 222, 214],
  ink: [28, 32, 38],
  faint: [96, 104, 116],
  accent: [0, 95, 153],
};

const DARK: Palette = {
  isDark: true,
  background: [15, 17, 21],
  free: [27, 31, 38],
  wall: [112, 121, 135],
  unknown: [44, 45, 46],
  ink: [232, 235, 240],
  faint: [156, 165, 178],
  accent: [102, 187, 240],
};

export function paletteOf(isDark: boolean): Palette {
  return isDark ? DARK : LIGHT;
}

export function css([r, g, b]: Rgb, alpha = 1): string {
  return `rgb(${r} ${g} ${b} / ${alpha})`;
}

export function mix(a: Rgb, b: Rgb, share: number): Rgb {
  return [0, 1, 2].map((i) => Math.round(a[i]! + (b[i]! - a[i]!) * share)) as Rgb;
}

/** Approximate luminance from 0 to 1, to distinguish dark from light. */
function lightness([r, g, b]: Rgb): number {
  return (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255;
}

/** The color as drawn: colors too dark for a dark floor are brightened. */
export function visibleColor(color: Rgb, palette: Palette): Rgb {
  if (!palette.isDark || lightness(color) > 0.3) return color;
  return mix(color, [255, 255, 255], 0.42);
}

/** Red, green, blue and opacity in the bytes of one word, in the order in which they lie in memory. */
export function packAppearance(appearance: Appearance, palette: Palette): number {
  const [r, g, b] = visibleColor(appearance.color, palette);
  return packColor([r, g, b], appearance.opacity);
}

/** Packed appearances of all groups in order: five per group, one for each condition. */
export function tintsOf(groups: readonly (readonly Appearance[])[], palette: Palette): Uint32Array {
  return Uint32Array.from(groups.flatMap((group) => group.map((appearance) => packAppearance(appearance, palette))));
}

export function packColor([r, g, b]: Rgb, alpha: number): number {
  return ((Math.round(alpha * 255) << 24) | (b << 16) | (g << 8) | r) >>> 0;
}

/** The style of marks by role. Colors are Okabe and Ito's; roles that share a color differ by dashes. */
export const ROLES: Record<MarkRole, { words: string; color: Rgb; dashed: boolean }> = {
  true: { words: "true", color: [0, 158, 115], dashed: false },
  reported: { words: "as reported", color: [230, 159, 0], dashed: true },
  wish: { words: "intended", color: [86, 180, 233], dashed: true },
  done: { words: "done", color: [0, 114, 178], dashed: false },
  refused: { words: "refused", color: [213, 94, 0], dashed: false },
  claim: { words: "claimed", color: [204, 121, 167], dashed: false },
  group: { words: "group", color: [230, 159, 0], dashed: false },
  predicted: { words: "predicted", color: [86, 180, 233], dashed: false },
  chosen: { words: "chosen", color: [0, 158, 115], dashed: false },
  known: { words: "known", color: [204, 121, 167], dashed: true },
  orbit: { words: "stored orbit", color: [0, 114, 178], dashed: true },
  target: { words: "target", color: [213, 94, 0], dashed: true },
  plan: { words: "plan", color: [0, 158, 115], dashed: true },
  wait: { words: "waits for", color: [213, 94, 0], dashed: false },
};
