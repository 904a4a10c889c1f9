/** Search for the agent under the pointer. */

import type { Frame } from "../decode";
import type { Bodies } from "../state/bodies";
import type { Camera } from "./camera";
import { flatRadiusOf } from "./extent";

/** A body can be picked up to this far from its border. */
const PICK_RADIUS_PX = 6;

/**
 * The agent drawn nearest to a point of the canvas, or undefined. All agents are tested: ten thousand
 * projections take less than a millisecond, and no spatial index has to follow moving bodies.
 */
export function pick(x_px: number, y_px: number, camera: Camera, frame: Frame, bodies: Bodies): number | undefined {
  const d = frame.dimensions;
  let found: number | undefined;
  let nearest_px = 0;
  for (const i of bodies.agents) {
    const shape = bodies.table.shapes[bodies.table.shape[i]!]!;
    const z = d === 3 ? frame.positions_m[i * d + 2]! : 0;
    const [x, y, inFront] = camera.project(frame.positions_m[i * d]!, frame.positions_m[i * d + 1]!, z);
    if (!inFront) continue;
    const border_px = Math.hypot(x - x_px, y - y_px) - flatRadiusOf(shape) / camera.mPerPx;
    if (border_px < PICK_RADIUS_PX && (found === undefined || border_px < nearest_px))
      [found, nearest_px] = [i, border_px];
  }
  return found;
}
