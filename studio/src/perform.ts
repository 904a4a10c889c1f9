/** Executes the actions of keys. */

import type { Action } from "./keys";
import { page } from "./state/page.svelte";
import type { TrailMode } from "./state/display.svelte";
import type { Session } from "./state/session.svelte";
import { viewports } from "./state/viewports";
import type { Studio } from "./state/studio.svelte";

const PAN_PX = 60;
const ZOOM = 1.25;
const TRAILS: readonly TrailMode[] = ["none", "selected", "all"];

/** Executes an action. Returns whether it applied to anything. */
export function perform(action: Action, key: string, studio: Studio): boolean {
  if (action === "help") page.showsHelp = true;
  else if (!studio.active) return false;
  else if (action === "session") return goTo(Number(key) - 1, studio);
  else if (!transport(action, studio)) view(action, studio.active);
  return true;
}

function goTo(index: number, studio: Studio): boolean {
  const session = studio.sessions[index];
  if (session) studio.activeKey = session.key;
  return session !== undefined;
}

function transport(action: Action, studio: Studio): boolean {
  const active = studio.active!;
  switch (action) {
    case "play":
      studio.toggle();
      return true;
    case "play-back":
      studio.toggleBack();
      return true;
    case "next":
      studio.step(1);
      return true;
    case "back":
      studio.step(-1);
      return true;
    case "next-ten":
      studio.step(10);
      return true;
    case "back-ten":
      studio.step(-10);
      return true;
    case "slower":
      for (const one of studio.controlled) one.playback.changeSpeed(-1);
      return true;
    case "faster":
      for (const one of studio.controlled) one.playback.changeSpeed(1);
      return true;
    case "next-event":
      active.jump(1);
      return true;
    case "previous-event":
      active.jump(-1);
      return true;
    default:
      return false;
  }
}

function view(action: Action, session: Session): void {
  const viewport = viewports.get(session.key);
  const moves: Partial<Record<Action, [number, number]>> = {
    left: [PAN_PX, 0],
    right: [-PAN_PX, 0],
    up: [0, PAN_PX],
    down: [0, -PAN_PX],
  };
  const move = moves[action];
  if (move) {
    viewport?.camera.rotate(...move);
    viewport?.onCameraMove();
  }
  if (action === "nearer" || action === "farther") viewport?.zoom(action === "nearer" ? ZOOM : 1 / ZOOM);
  if (action === "fit") viewport?.fit();
  if (action === "trails")
    session.display.trails = TRAILS[(TRAILS.indexOf(session.display.trails) + 1) % TRAILS.length]!;
  if (action === "follow") session.display.follows = !session.display.follows;
  if (action === "edit" && !session.isFleet && !session.isReplay) page.edits = !page.edits;
  if (action === "deselect") session.selection.select(null);
  if (action === "filter") {
    page.tab = "agents";
    page.filterRequests++;
  }
  if (action === "center" && session.selection.body) {
    const index = session.frames.bodies?.find(session.selection.body);
    if (index !== undefined) viewport?.center(index);
  }
  viewport?.requestDraw();
}
