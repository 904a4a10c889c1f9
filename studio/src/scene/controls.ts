/** Pointer, wheel and touch input of a canvas. */

import { PlaneCamera, type Camera } from "./camera";

export interface PointerHandlers {
  camera(): Camera | null;
  onMove(): void;
  onHover(x_px: number, y_px: number): void;
  onLeave(): void;
  onClick(x_px: number, y_px: number): void;
}

/** A press that moves less than this counts as a click. */
const CLICK_PX = 4;

export function attachPointer(canvas: HTMLElement, handlers: PointerHandlers): () => void {
  const fingers = new Map<number, [number, number]>();
  let traveled_px = 0;
  const at = (event: MouseEvent): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };

  const down = (event: PointerEvent): void => {
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) traveled_px = 0;
    fingers.set(event.pointerId, at(event));
  };
  const move = (event: PointerEvent): void => {
    const now = at(event);
    const before = fingers.get(event.pointerId);
    if (!before) return handlers.onHover(...now);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    traveled_px += Math.hypot(dx, dy);
    if (fingers.size === 2) pinch(event.pointerId, before, now);
    else if (traveled_px >= CLICK_PX) drag(event, dx, dy);
    fingers.set(event.pointerId, now);
  };
  const drag = (event: PointerEvent, dx: number, dy: number): void => {
    const camera = handlers.camera();
    if (!camera) return;
    const pans = camera instanceof PlaneCamera || event.shiftKey || (event.buttons & 6) !== 0;
    if (pans) camera.pan(dx, dy);
    else camera.rotate(dx, dy);
    handlers.onMove();
  };
  const pinch = (id: number, before: [number, number], now: [number, number]): void => {
    const other = [...fingers].find(([key]) => key !== id)?.[1];
    const camera = handlers.camera();
    if (!other || !camera) return;
    const span = (p: [number, number]): number => Math.max(10, Math.hypot(p[0] - other[0], p[1] - other[1]));
    camera.zoom(span(now) / span(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    camera.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    handlers.onMove();
  };
  const up = (event: PointerEvent): void => {
    const wasDown = fingers.delete(event.pointerId);
    if (wasDown && event.type === "pointerup" && traveled_px < CLICK_PX && event.button === 0)
      handlers.onClick(...at(event));
  };
  const wheel = (event: WheelEvent): void => {
    event.preventDefault();
    const camera = handlers.camera();
    if (!camera) return;
    const lines = event.deltaMode === 1 ? 30 : 1;
    camera.zoom(Math.exp(-event.deltaY * lines * 0.0015), ...at(event));
    handlers.onMove();
  };
  const noMenu = (event: Event): void => event.preventDefault();
  const leave = (): void => handlers.onLeave();

  canvas.addEventListener("pointerdown", down);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", leave);
  canvas.addEventListener("wheel", wheel, { passive: false });
  canvas.addEventListener("contextmenu", noMenu);
  return () => {
    canvas.removeEventListener("pointerdown", down);
    canvas.removeEventListener("pointermove", move);
    canvas.removeEventListener("pointerup", up);
    canvas.removeEventListener("pointercancel", up);
    canvas.removeEventListener("pointerleave", leave);
    canvas.removeEventListener("wheel", wheel);
    canvas.removeEventListener("contextmenu", noMenu);
  };
}
