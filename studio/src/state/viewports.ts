/** The viewports on the page, for keys and tests that act on them. */

import type { Scene } from "../protocol";
import type { Camera } from "../scene/camera";
import type { Viewport } from "../scene/viewport";
import type { Projection } from "./display.svelte";

export const viewports = new Map<number, Viewport>();

/** The last camera of each session, so that a restart or a change of tabs keeps the view. */
const cameras = new Map<number, { camera: Camera; key: string }>();

/** What a canvas is made for: a scene of another kind, as after another text, needs another canvas. */
export function canvasKind({ dimensions, traffic }: Scene, projection: Projection): string {
  return `${dimensions}-${traffic === null ? "bodies" : "traffic"}-${projection}`;
}

/** Scenes with different keys need different cameras. */
function viewKey({ world, dimensions, floor, bodies }: Scene): string {
  return JSON.stringify([world, dimensions, floor?.width, floor?.height, floor?.box_m, floor?.origin_m, bodies.length]);
}

export function saveCamera(session: number, scene: Scene, camera: Camera): void {
  cameras.set(session, { camera, key: viewKey(scene) });
}

/** Discards the camera: the session is shown as a whole next time. */
export function discardCamera(session: number): void {
  cameras.delete(session);
}

export function savedCamera(session: number, scene: Scene): Camera | undefined {
  const saved = cameras.get(session);
  return saved?.key === viewKey(scene) ? saved.camera : undefined;
}
