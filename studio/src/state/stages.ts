/** The canvases that are on the page, for keys and tests that act on them. */

import type { Scene } from "../protocol";
import type { Eye } from "../scene/camera";
import type { Stage } from "../scene/stage";

export const stages = new Map<number, Stage>();

/** The last viewpoint of each session, so that a new start or a visit to another tab changes no view. */
const eyes = new Map<number, { eye: Eye; of: string }>();

/** Scenes that differ here need another view. */
function measureOf({ world, dimensions, floor, bodies }: Scene): string {
  return JSON.stringify([world, dimensions, floor?.width, floor?.height, floor?.box_m, floor?.origin_m, bodies.length]);
}

export function keepEye(session: number, scene: Scene, eye: Eye): void {
  eyes.set(session, { eye, of: measureOf(scene) });
}

/** Lets the session be seen as a whole when it is looked at again. */
export function forgetEye(session: number): void {
  eyes.delete(session);
}

export function keptEye(session: number, scene: Scene): Eye | undefined {
  const kept = eyes.get(session);
  return kept?.of === measureOf(scene) ? kept.eye : undefined;
}
