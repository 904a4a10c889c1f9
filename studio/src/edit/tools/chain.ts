/** Obstacles, starts and targets of chains in the plane. */

import type { Edit, Place } from "../../protocol";
import { isWithin, numbersOf, sectionsOf, valueAt, type Json, type Path, type Table } from "../keypath";
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

/** The obstacle that a tool works on: the chosen one, or the one that the chosen point belongs to. */
function chosenObstacle(model: Table, chosen: Path | null): { path: Path; value: Table } | undefined {
  return chosen ? sectionsOf(model, "obstacles").find(({ path }) => isWithin(chosen, path)) : undefined;
}

/** The distance of a place from a piece of an outline. */
function distance(at: Place, a: Place, b: Place): number {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const along = ((at[0] - a[0]) * dx + (at[1] - a[1]) * dy) / (dx * dx + dy * dy || 1);
  const t = Math.min(1, Math.max(0, along));
  return Math.hypot(at[0] - a[0] - t * dx, at[1] - a[1] - t * dy);
}

/** The edge of a closed outline that is nearest to a place: the number of its second corner. */
function nearestEdge(at: Place, corners: Place[]): number {
  const far = corners.map((corner, i) => distance(at, corners[(i + corners.length - 1) % corners.length]!, corner));
  const nearest = far.indexOf(Math.min(...far));
  return nearest === 0 ? corners.length : nearest;
}

/** One more corner of the chosen polygon, in its nearest edge; else a triangle on the way of the drag. */
export function putPolygon(model: Table, a: Place, b: Place, chosen: Path | null, m_per_px: number): Edit[] {
  const round = ([x, y]: readonly number[]): number[] => [rounded(x!, m_per_px), rounded(y!, m_per_px)];
  const host = chosenObstacle(model, chosen);
  const corners = pointsOf(host?.value["corners_m"]);
  if (host && corners.length >= 3) {
    return [{ ...insert([...host.path, "corners_m"], round(b)), at: nearestEdge(b, corners) } as Edit];
  }
  if (Math.hypot(b[0] - a[0], b[1] - a[1]) < m_per_px) return [];
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  // The third corner stands off to the left, so that all sides are about as long.
  const third = [a[0] + 0.5 * dx - 0.8 * dy, a[1] + 0.5 * dy + 0.8 * dx];
  return [insert(["obstacles"], { corners_m: [round(a), round(b), round(third)] })];
}

/** One more way-point of the chosen obstacle's patrol; the first makes it go there from where it is, and back. */
export function putPatrol(model: Table, to: Place, chosen: Path | null, m_per_px: number): Edit[] {
  const place = [rounded(to[0], m_per_px), rounded(to[1], m_per_px)];
  const fits = ({ value }: { value: Table }): boolean => value["at_m"] !== undefined && value["corners_m"] === undefined;
  const own = chosenObstacle(model, chosen);
  const host = own && fits(own) ? own : sectionsOf(model, "obstacles").filter(fits).at(-1);
  const from = host ? numbersOf(host.value["at_m"], 2) : null;
  if (!host || !from) return [];
  if (Array.isArray(host.value["patrol_m"])) return [insert([...host.path, "patrol_m"], place)];
  // A patrol takes the place of a straight way.
  const gone = ["bounces_m", "velocity_m_s"].filter((key) => host.value[key] !== undefined);
  return [...gone.map((key) => remove([...host.path, key])), set([...host.path, "patrol_m"], [from, place]), set([...host.path, "speed_m_s"], 0.5)];
}
