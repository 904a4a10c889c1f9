/** Handles along the axes of space, at the chosen thing: a drag in the picture alone cannot tell its depth. */

import type { Place } from "../protocol";
import type { Eye } from "../scene/camera";

export type Axis = 0 | 1 | 2;
export const AXES: readonly Axis[] = [0, 1, 2];
export const AXIS_NAMES = ["x", "y", "z"] as const;

/** Length of a handle where it lies across the view. */
const LENGTH_PX = 60;
/** Greatest distance from its tip at which an axis is taken hold of. */
const NEAR_PX = 11;
/** An axis that points at the viewer has no length to drag along. */
const LEAST_PX = 10;

export interface AxisHandle {
  axis: Axis;
  tip_m: Place;
}

function pixels(eye: Eye, at: Place): [number, number] {
  const [x, y] = eye.project(...at);
  return [x, y];
}

/** The handles of a place that can be dragged from where the eye is. */
export function handlesAt(eye: Eye, at: Place): AxisHandle[] {
  const [x, y] = pixels(eye, at);
  return AXES.flatMap((axis) => {
    const tip_m: Place = [...at];
    tip_m[axis] += LENGTH_PX * eye.mPerPx;
    const [tx, ty] = pixels(eye, tip_m);
    return Math.hypot(tx - x, ty - y) < LEAST_PX ? [] : [{ axis, tip_m }];
  });
}

/** The axis whose handle is at a point of the canvas. */
export function axisAt(eye: Eye, at: Place, x_px: number, y_px: number): Axis | null {
  const found = handlesAt(eye, at).find(({ tip_m }) => {
    const [x, y] = pixels(eye, tip_m);
    return Math.hypot(x - x_px, y - y_px) <= NEAR_PX;
  });
  return found?.axis ?? null;
}

/** Returns the place to which one goes along an axis when the pointer goes by so many pixels. */
export function along(eye: Eye, at: Place, axis: Axis, dx_px: number, dy_px: number): Place {
  const handle = handlesAt(eye, at).find((one) => one.axis === axis);
  const by: Place = [0, 0, 0];
  if (!handle) return by;
  const [[x, y], [tx, ty]] = [pixels(eye, at), pixels(eye, handle.tip_m)];
  const [ax, ay] = [tx - x, ty - y];
  by[axis] = ((dx_px * ax + dy_px * ay) / (ax * ax + ay * ay)) * (handle.tip_m[axis] - at[axis]);
  return by;
}
