/** Items that can be touched on the canvas of a draft, and the edits that tools ask for. */

import type { Edit, Place } from "../../protocol";
import { keyOf, type Path, type Table } from "../keypath";

/** A thing of the scenario with a place of its own. */
export interface Item {
  /** Its path: problems below it belong to it. */
  path: Path;
  words: string;
  kind: "body" | "goal" | "point" | "area" | "start";
  /** Its outline, or its one place. */
  outline_m: Place[];
  isClosed: boolean;
  /** The place where it is taken hold of. */
  at_m: Place;
  /** The edits that bring it elsewhere. */
  move(to_m: Place): Edit[];
  /** The edits that take it away. */
  remove(): Edit[];
  /** The edits that turn it by a quarter, if it has a heading. */
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

/** The numbers of a place as people write them: to a centimeter near by, to a meter over kilometers. */
export function rounded(value: number, m_per_px: number): number {
  const digits = Math.min(6, Math.max(0, Math.ceil(-Math.log10(Math.max(m_per_px, 1e-6)))));
  const cut = Number(value.toFixed(digits));
  return cut === 0 ? 0 : cut;
}

/** Corners of a circle. */
export function ring([x, y, z]: Place, radius_m: number, corners = 32): Place[] {
  return Array.from({ length: corners }, (_, i) => {
    const angle = (2 * Math.PI * i) / corners;
    return [x + radius_m * Math.cos(angle), y + radius_m * Math.sin(angle), z];
  });
}

/** Corners of a box around a place. */
export function box([x, y]: Place, width: number, height: number, turn_rad = 0): Place[] {
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

/** The edits that take one of a list away, or the whole section with its last. */
export function removeFrom(section: Path, key: string, index: number, value: Table): Edit[] {
  const list = value[key];
  const isLast = Array.isArray(list) && list.length === 1;
  return [remove(isLast ? section : [...section, key, index])];
}
