/** Draws trails, which fade toward their old ends. */

import type { BodyId } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { TrailMode } from "../state/display.svelte";
import { flatRadiusOf } from "./extent";
import { packColor, visibleColor, type Palette, type Rgb } from "./palette";
import type { Strokes } from "./strokes";
import type { Trails } from "./trails";

/** The bodies whose trails are shown. */
export function bodiesWithTrails(bodies: Bodies, mode: TrailMode, selected: BodyId | null): Iterable<number> {
  if (mode === "all") return bodies.agents;
  const index = selected ? bodies.find(selected) : undefined;
  return mode === "selected" && index !== undefined ? [index] : [];
}

export interface TrailStyle {
  bodies: Bodies;
  trails: Trails;
  palette: Palette;
  widthIsTrue: boolean;
  /** The color that a body has instead of its own; null where it has its own. */
  colorOf: (index: number) => Rgb | null;
}

export function drawTrail(strokes: Strokes, index: number, style: TrailStyle): void {
  const { bodies, trails, palette, widthIsTrue } = style;
  const { table } = bodies;
  const points = trails.points(index);
  const own = table.appearances[table.appearance[index]!]![0].color;
  const color = visibleColor(style.colorOf(index) ?? own, palette);
  const width_m = widthIsTrue ? 2 * flatRadiusOf(table.shapes[table.shape[index]!]!) : 0;
  const maxAlpha = widthIsTrue ? 0.35 : 0.85;
  for (let i = 1; i < points.length; i++) {
    const alpha = maxAlpha * (0.12 + (0.88 * i) / points.length);
    strokes.piece(points[i - 1]!, points[i]!, 1.5, width_m, packColor(color, alpha));
  }
}
