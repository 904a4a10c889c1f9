/** Search for the agent under the pointer. */

import type { Frame } from "../decode";
import type { Bodies } from "../state/cast";
import type { Eye } from "./camera";
import { flatRadiusOf } from "./extent";

/** A body counts as met this far from its border. */
const NEAR_PX = 6;

/**
 * The agent whose picture is nearest to a point of the canvas, or undefined. All agents are looked at: ten thousand
 * projections take less than a millisecond, and no index has to follow moving bodies.
 */
export function pick(x_px: number, y_px: number, eye: Eye, frame: Frame, bodies: Bodies): number | undefined {
  const d = frame.dimensions;
  let found: number | undefined;
  let least = 0;
  for (const i of bodies.agents) {
    const shape = bodies.cast.shapes[bodies.cast.shape[i]!]!;
    const z = d === 3 ? frame.places_m[i * d + 2]! : 0;
    const [x, y, inFront] = eye.project(frame.places_m[i * d]!, frame.places_m[i * d + 1]!, z);
    if (!inFront) continue;
    const border_px = Math.hypot(x - x_px, y - y_px) - flatRadiusOf(shape) / eye.mPerPx;
    if (border_px < NEAR_PX && (found === undefined || border_px < least)) [found, least] = [i, border_px];
  }
  return found;
}
