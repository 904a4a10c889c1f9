/** The bounding box of a scene. */

import type { Frame } from "../decode";
import type { Scene, Shape } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { Extent } from "./camera";

/** The radius of the bounding sphere of a shape around the body's position. */
export function radiusOf(shape: Shape): number {
  if (shape.type === "sphere") return shape.radius_m;
  if (shape.type === "cylinder") return Math.max(shape.radius_m, 0.5 * shape.height_m);
  if (shape.type === "dart") return 0.5 * Math.max(shape.length_m, shape.width_m);
  return shape.type === "cuboid" ? 0.5 * Math.hypot(...shape.size_m) : 0;
}

/** The same, seen from above. */
export function flatRadiusOf(shape: Shape): number {
  if (shape.type === "cylinder") return shape.radius_m;
  return shape.type === "cuboid" ? 0.5 * Math.hypot(shape.size_m[0], shape.size_m[1]) : radiusOf(shape);
}

export function extentOf(scene: Scene, bodies: Bodies | null, frame: Frame | null): Extent {
  const lo: [number, number, number] = [Infinity, Infinity, Infinity];
  const hi: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  const include = (x: number, y: number, z: number, r: number): void => {
    [x, y, z].forEach((value, k) => {
      lo[k] = Math.min(lo[k]!, value - r);
      hi[k] = Math.max(hi[k]!, value + r);
    });
  };
  includeFloor(scene, include);
  for (const { at_m, shape } of scene.bodies) {
    include(at_m[0], at_m[1], at_m[2], radiusOf(shape));
    if (shape.type === "line") for (const [x, y, z] of shape.points_m) include(x, y, z, 0);
  }
  if (frame && bodies) {
    const d = frame.dimensions;
    for (let i = 0; i < frame.bodies; i++) {
      const shape = bodies.table.shapes[bodies.table.shape[i]!]!;
      if (shape.type === "line") continue;
      const at = frame.positions_m.subarray(i * d, i * d + d);
      include(at[0]!, at[1]!, at[2] ?? 0, radiusOf(shape));
    }
    for (let i = 0; i < frame.points_m.length; i += d) {
      include(frame.points_m[i]!, frame.points_m[i + 1]!, d === 3 ? frame.points_m[i + 2]! : 0, 0);
    }
  }
  return Number.isFinite(lo[0]) ? { low: lo, high: hi } : { low: [-1, -1, -1], high: [1, 1, 1] };
}

function includeFloor({ floor }: Scene, include: (x: number, y: number, z: number, r: number) => void): void {
  if (!floor) return;
  const [w, h] = [floor.width * floor.box_m, floor.height * floor.box_m];
  const [c, s] = [Math.cos(floor.yaw_rad), Math.sin(floor.yaw_rad)];
  for (const [x, y] of [
    [0, 0],
    [w, 0],
    [0, h],
    [w, h],
  ] as const) {
    include(floor.origin_m[0] + c * x - s * y, floor.origin_m[1] + s * x + c * y, 0, 0);
  }
}
