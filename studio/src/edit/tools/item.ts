/** Items that can be edited on the canvas of a draft, and the edits of tools. */

import type { Edit, Point3 } from "../../protocol";
import { keyOf, type Path, type TomlTable } from "../keypath";

/** An object of the scenario with a position of its own. */
export interface Item {
  /** Its path: problems below it belong to it. */
  path: Path;
  words: string;
  kind: "body" | "goal" | "point" | "area" | "start";
  /** Its outline, or its position alone. */
  outline_m: Point3[];
  isClosed: boolean;
  /** The position where it is picked and dragged. */
  at_m: Point3;
  /** The edits that move it. */
  move(to_m: Point3): Edit[];
  /** The edits that remove it. */
  remove(): Edit[];
  /** The edits that rotate it by 90 degrees, if it has a heading. */
  turn?(): Edit[];
}

export function set(path: Path, value: unknown): Edit {
  return { op: "set", key: keyOf(path), value };
}

export function insert(path: Path, value: unknown): Edit {
  return { op: "insert", key: keyOf(path), at: null, value };
}

export function remove(path: Path): Edit {
  return { op: "remove", key: keyOf(path) };
}

/** A coordinate rounded to the precision of the view: centimeters when zoomed in, meters over kilometers. */
export function roundTo(value: number, m_per_px: number): number {
  const digits = Math.min(6, Math.max(0, Math.ceil(-Math.log10(Math.max(m_per_px, 1e-6)))));
  const cut = Number(value.toFixed(digits));
  return cut === 0 ? 0 : cut;
}

/** Corners of a circle. */
export function ring([x, y, z]: Point3, radius_m: number, corners = 32): Point3[] {
  return Array.from({ length: corners }, (_, i) => {
    const angle = (2 * Math.PI * i) / corners;
    return [x + radius_m * Math.cos(angle), y + radius_m * Math.sin(angle), z];
  });
}

/** Corners of a box around a position. */
export function box([x, y]: Point3, width: number, height: number, turn_rad = 0): Point3[] {
  const [c, s] = [Math.cos(turn_rad), Math.sin(turn_rad)];
  return [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ].map(([i, j]) => {
    const [u, v] = [(i! * width) / 2, (j! * height) / 2];
    return [x + c * u - s * v, y + s * u + c * v, 0];
  });
}

/** The edits that remove an element of a list, or the whole section with its last element. */
export function removeFrom(section: Path, key: string, index: number, value: TomlTable): Edit[] {
  const list = value[key];
  const isLast = Array.isArray(list) && list.length === 1;
  return [remove(isLast ? section : [...section, key, index])];
}
