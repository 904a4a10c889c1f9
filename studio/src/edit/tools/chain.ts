/** Obstacles, starts and targets of chains in the plane. */

import type { Edit, Place } from "../../protocol";
import { numbersOf, sectionsOf, valueAt, type Json, type Path, type Table } from "../keypath";
import { box, insert, remove, removeFrom, ring, rounded, set, type Item } from "./item";

/** How near obstacles of no thickness can be taken hold of. */
const THIN_M = 0.02;

function pointOf(value: Json | undefined): Place | null {
  const numbers = numbersOf(value, 2);
  return numbers && numbers.length === 2 ? [numbers[0]!, numbers[1]!, 0] : null;
}

function pointsOf(value: Json | undefined): Place[] {
  const points = Array.isArray(value) ? value.map(pointOf) : [];
  return points.every((one) => one !== null) ? points : [];
}

/** A point that is moved alone. */
function handle(path: Path, words: string, kind: Item["kind"], at: Place, m_per_px: number, removes: () => Edit[]): Item {
  return {
    path, words, kind, outline_m: [at], isClosed: false, at_m: at,
    move: ([x, y]) => [set(path, [rounded(x, m_per_px), rounded(y, m_per_px)])], remove: removes,
  };
}

/** Everything of a scenario of chains in the plane that has a place of its own. */
export function chainItems(model: Table, m_per_px: number): Item[] {
  const obstacles = sectionsOf(model, "obstacles").flatMap(({ path, value }, i) => obstacleItems(path, value, i, m_per_px));
  const chains = sectionsOf(model, "chains").flatMap(({ path, value }, i) => startItems(path, value, i, m_per_px));
  return [...obstacles, ...chains];
}

function obstacleItems(path: Path, value: Table, number: number, m_per_px: number): Item[] {
  const words = `obstacle ${number + 1}`;
  const radius = typeof value["radius_m"] === "number" ? value["radius_m"] : 0;
  const gone = (): Edit[] => [remove(path)];
  const way = pointsOf(value["patrol_m"]).map((at, i) =>
    handle([...path, "patrol_m", i], `way-point ${i + 1} of ${words}`, "goal", at, m_per_px, () => removeFrom(path, "patrol_m", i, value)),
  );
  const at = pointOf(value["at_m"]);
  const sides = numbersOf(value["size_m"], 2);
  if (at) {
    const turn = typeof value["turn_deg"] === "number" ? (value["turn_deg"] * Math.PI) / 180 : 0;
    const outline_m = sides ? box(at, sides[0]!, sides[1]!, turn) : ring(at, Math.max(radius, THIN_M));
    const own: Item = { ...handle([...path, "at_m"], words, "body", at, m_per_px, gone), path, outline_m, isClosed: true };
    return [own, ...way];
  }
  const key = value["ends_m"] !== undefined ? "ends_m" : "corners_m";
  const points = pointsOf(value[key]);
  if (points.length < 2) return way;
  return [whole(path, key, words, points, key === "corners_m", m_per_px), ...corners(path, key, words, points, value, m_per_px), ...way];
}

/** A wall or a polygon as a whole: all of its points go the same way. */
function whole(path: Path, key: string, words: string, points: Place[], isClosed: boolean, m_per_px: number): Item {
  const middle = [0, 1].map((k) => points.reduce((sum, p) => sum + p[k]!, 0) / points.length) as [number, number];
  return {
    path, words, kind: "body", outline_m: points, isClosed, at_m: [middle[0], middle[1], 0],
    move: ([x, y]) => [set([...path, key], points.map((p) => [rounded(p[0] + x - middle[0], m_per_px), rounded(p[1] + y - middle[1], m_per_px)]))],
    remove: () => [remove(path)],
  };
}

function corners(path: Path, key: string, words: string, points: Place[], value: Table, m_per_px: number): Item[] {
  const least = key === "ends_m" ? 2 : 3;
  return points.map((at, i) =>
    handle([...path, key, i], `corner ${i + 1} of ${words}`, "point", at, m_per_px, () =>
      points.length > least ? removeFrom(path, key, i, value) : [remove(path)],
    ),
  );
}

function startItems(path: Path, value: Table, number: number, m_per_px: number): Item[] {
  const words = typeof value["name"] === "string" ? value["name"] : `chain ${number + 1}`;
  const at = pointOf(value["at_m"]);
  const start = at ? [handle([...path, "at_m"], `start of ${words}`, "start", at, m_per_px, () => [remove(path)])] : [];
  const tasks = valueAt(value, ["tasks"]);
  const list = Array.isArray(tasks) ? tasks : tasks === undefined ? [] : [tasks];
  const targets = list.flatMap((task, t) => {
    const own = Array.isArray(tasks) ? [...path, "tasks", t] : [...path, "tasks"];
    return pointsOf(valueAt(task, ["targets_m"])).map((target, i) =>
      handle([...own, "targets_m", i], `target ${i + 1} of ${words}`, "goal", target, m_per_px, () => removeFrom(own, "targets_m", i, task as Table)),
    );
  });
  return [...start, ...targets];
}

/** A ball around a place; from a drag, as large as that. */
export function putBall(at: Place, radius_m: number, m_per_px: number): Edit[] {
  return [insert(["obstacles"], { at_m: [rounded(at[0], m_per_px), rounded(at[1], m_per_px)], radius_m: rounded(radius_m, m_per_px) })];
}

/** A box between two corners. */
export function putBox(a: Place, b: Place, m_per_px: number): Edit[] {
  const round = (value: number): number => rounded(value, m_per_px);
  const size_m = [round(Math.abs(b[0] - a[0])), round(Math.abs(b[1] - a[1]))];
  if (size_m.some((side) => side <= 0)) return [];
  return [insert(["obstacles"], { at_m: [round((a[0] + b[0]) / 2), round((a[1] + b[1]) / 2)], size_m })];
}

/** A wall from one place to another. */
export function putWall(a: Place, b: Place, m_per_px: number): Edit[] {
  const round = ([x, y]: Place): number[] => [rounded(x, m_per_px), rounded(y, m_per_px)];
  if (Math.hypot(b[0] - a[0], b[1] - a[1]) < m_per_px) return [];
  return [insert(["obstacles"], { ends_m: [round(a), round(b)], radius_m: 0.1 })];
}
