/** The legend of marks in an image: as the page shows it beside the canvas. */

import type { MarkRole } from "../protocol";
import { css, ROLES, type Palette } from "./palette";

const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";
const SWATCH_PX = 18;
const GAP_PX = 6;
const LINE_PX = 18;
const PADDING_PX = 8;
const MARGIN_PX = 8;
/** Distance between two entries in a row. */
const ROW_GAP_PX = 10;
/** Pictures that are narrower have it along their upper edge, not over half of what it explains. */
const MIN_COLUMN_PX = 480;

interface Entry {
  role: MarkRole;
  width_px: number;
}

/** The entries in rows: one in each where there is room, else as many as fit. */
function rowsOf(entries: readonly Entry[], width_px: number): Entry[][] {
  if (width_px >= MIN_COLUMN_PX) return entries.map((entry) => [entry]);
  const room_px = width_px - 2 * (MARGIN_PX + PADDING_PX);
  const rows: Entry[][] = [];
  let left_px = 0;
  for (const entry of entries) {
    const isFitting = rows.length > 0 && entry.width_px + ROW_GAP_PX <= left_px;
    if (isFitting) rows.at(-1)!.push(entry);
    else rows.push([entry]);
    left_px = isFitting ? left_px - entry.width_px - ROW_GAP_PX : room_px - entry.width_px;
  }
  return rows;
}

/** Draws the legend of some roles into the upper right corner of an image of this width; nothing without roles. */
export function drawLegend(
  pen: CanvasRenderingContext2D,
  roles: ReadonlySet<MarkRole>,
  width_px: number,
  palette: Palette,
): void {
  if (roles.size === 0) return;
  pen.font = FONT;
  const entries = [...roles].map((role) => ({
    role,
    width_px: SWATCH_PX + GAP_PX + pen.measureText(ROLES[role].words).width,
  }));
  const rows = rowsOf(entries, width_px);
  const widthOf = (row: Entry[]): number =>
    row.reduce((sum, entry) => sum + entry.width_px, (row.length - 1) * ROW_GAP_PX);
  const box = {
    width: Math.max(...rows.map(widthOf)) + 2 * PADDING_PX,
    height: rows.length * LINE_PX + PADDING_PX,
  };
  const left = width_px - MARGIN_PX - box.width;
  pen.fillStyle = css(palette.free, 0.94);
  pen.strokeStyle = css(palette.faint, 0.6);
  pen.lineWidth = 1;
  pen.setLineDash([]);
  pen.fillRect(left, MARGIN_PX, box.width, box.height);
  pen.strokeRect(left + 0.5, MARGIN_PX + 0.5, box.width - 1, box.height - 1);
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  rows.forEach((row, index) => {
    const y = MARGIN_PX + PADDING_PX / 2 + (index + 0.5) * LINE_PX;
    let x = left + PADDING_PX;
    for (const { role, width_px: entry_px } of row) {
      const { words, color, dashed } = ROLES[role];
      pen.lineWidth = 3;
      pen.strokeStyle = css(color);
      pen.setLineDash(dashed ? [5, 3] : []);
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(x + SWATCH_PX, y);
      pen.stroke();
      pen.fillStyle = css(palette.ink);
      pen.fillText(words, x + SWATCH_PX + GAP_PX, y);
      x += entry_px + ROW_GAP_PX;
    }
  });
  pen.setLineDash([]);
}
