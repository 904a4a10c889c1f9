/** Pointer, wheel and fingers on a canvas. */

import { PlaneEye, type Eye } from "./camera";

export interface Hand {
  eye(): Eye | null;
  moved(): void;
  hover(x_px: number, y_px: number): void;
  left(): void;
  click(x_px: number, y_px: number): void;
}

/** A press that moves less than this is a click. */
const CLICK_PX = 4;

export function attach(canvas: HTMLElement, hand: Hand): () => void {
  const fingers = new Map<number, [number, number]>();
  let traveled = 0;
  const at = (event: MouseEvent): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };

  const down = (event: PointerEvent): void => {
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) traveled = 0;
    fingers.set(event.pointerId, at(event));
  };
  const move = (event: PointerEvent): void => {
    const now = at(event);
    const before = fingers.get(event.pointerId);
    if (!before) return hand.hover(...now);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    traveled += Math.hypot(dx, dy);
    if (fingers.size === 2) pinch(event.pointerId, before, now);
    else if (traveled >= CLICK_PX) drag(event, dx, dy);
    fingers.set(event.pointerId, now);
  };
  const drag = (event: PointerEvent, dx: number, dy: number): void => {
    const eye = hand.eye();
    if (!eye) return;
    const pans = eye instanceof PlaneEye || event.shiftKey || (event.buttons & 6) !== 0;
    if (pans) eye.pan(dx, dy);
    else eye.rotate(dx, dy);
    hand.moved();
  };
  const pinch = (id: number, before: [number, number], now: [number, number]): void => {
    const other = [...fingers].find(([key]) => key !== id)?.[1];
    const eye = hand.eye();
    if (!other || !eye) return;
    const span = (p: [number, number]): number => Math.max(10, Math.hypot(p[0] - other[0], p[1] - other[1]));
    eye.zoom(span(now) / span(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    eye.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    hand.moved();
  };
  const up = (event: PointerEvent): void => {
    const wasDown = fingers.delete(event.pointerId);
    if (wasDown && event.type === "pointerup" && traveled < CLICK_PX && event.button === 0) hand.click(...at(event));
  };
  const wheel = (event: WheelEvent): void => {
    event.preventDefault();
    const eye = hand.eye();
    if (!eye) return;
    const lines = event.deltaMode === 1 ? 30 : 1;
    eye.zoom(Math.exp(-event.deltaY * lines * 0.0015), ...at(event));
    hand.moved();
  };
  const noMenu = (event: Event): void => event.preventDefault();
  const leave = (): void => hand.left();

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
