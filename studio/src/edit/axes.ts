/** Handles along the axes in space, at the selected item: a drag on the screen alone has no depth. */

import type { Point3 } from "../protocol";
import type { Camera } from "../scene/camera";

export type Axis = 0 | 1 | 2;
export const AXES: readonly Axis[] = [0, 1, 2];
export const AXIS_NAMES = ["x", "y", "z"] as const;

/** Length of a handle that is perpendicular to the view. */
const LENGTH_PX = 60;
/** Maximum distance from its tip at which an axis is picked. */
const PICK_RADIUS_PX = 11;
/** Minimum visible length: an axis that points at the viewer cannot be dragged. */
const MIN_LENGTH_PX = 10;

export interface AxisHandle {
  axis: Axis;
  tip_m: Point3;
}

function toPixels(camera: Camera, at: Point3): [number, number] {
  const [x, y] = camera.project(...at);
  return [x, y];
}

/** The handles of a position that can be dragged in this view. */
export function handlesAt(camera: Camera, at: Point3): AxisHandle[] {
  const [x, y] = toPixels(camera, at);
  return AXES.flatMap((axis) => {
    const tip_m: Point3 = [...at];
    tip_m[axis] += LENGTH_PX * camera.mPerPx;
    const [tx, ty] = toPixels(camera, tip_m);
    return Math.hypot(tx - x, ty - y) < MIN_LENGTH_PX ? [] : [{ axis, tip_m }];
  });
}

/** The axis whose handle is at a point of the canvas. */
export function axisAt(camera: Camera, at: Point3, x_px: number, y_px: number): Axis | null {
  const found = handlesAt(camera, at).find(({ tip_m }) => {
    const [x, y] = toPixels(camera, tip_m);
    return Math.hypot(x - x_px, y - y_px) <= PICK_RADIUS_PX;
  });
  return found?.axis ?? null;
}

/** Returns the displacement along an axis for a movement of the pointer. */
export function dragAlong(camera: Camera, at: Point3, axis: Axis, dx_px: number, dy_px: number): Point3 {
  const handle = handlesAt(camera, at).find((one) => one.axis === axis);
  const by: Point3 = [0, 0, 0];
  if (!handle) return by;
  const [[x, y], [tx, ty]] = [toPixels(camera, at), toPixels(camera, handle.tip_m)];
  const [ax, ay] = [tx - x, ty - y];
  by[axis] = ((dx_px * ax + dy_px * ay) / (ax * ax + ay * ay)) * (handle.tip_m[axis] - at[axis]);
  return by;
}
