/** Small pictures of what sessions show, for the list of recent files. */

import { rememberPicture } from "./recents";
import type { Session } from "./session.svelte";
import { viewports } from "./viewports";

const WIDTH_PX = 240;
const HEIGHT_PX = 150;
/** Quality at which a picture takes some kilobytes. */
const QUALITY = 0.72;

/** Keeps a picture of the view of a session; without a view the last one stays. */
export function keepThumbnail(session: Session): void {
  const viewport = viewports.get(session.key);
  if (!viewport || session.frames.newest === null || session.isFleet || session.isReplay) return;
  const shown = viewport.compose();
  if (shown.width === 0 || shown.height === 0) return;
  const canvas = document.createElement("canvas");
  canvas.width = WIDTH_PX;
  canvas.height = HEIGHT_PX;
  const pen = canvas.getContext("2d");
  if (!pen) return;
  // The middle of the view, as large as fits without bars.
  const scale = Math.max(WIDTH_PX / shown.width, HEIGHT_PX / shown.height);
  const [width, height] = [shown.width * scale, shown.height * scale];
  pen.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--panel");
  pen.fillRect(0, 0, WIDTH_PX, HEIGHT_PX);
  pen.drawImage(shown, (WIDTH_PX - width) / 2, (HEIGHT_PX - height) / 2, width, height);
  rememberPicture(session.target, canvas.toDataURL("image/webp", QUALITY));
}
