/** Obstacles, starts and targets of chains; tools that put new ones are for the plane. */

import type { Edit, Place } from "../../protocol";
import { isWithin, numbersOf, sectionsOf, valueAt, type Json, type Path, type Table } from "../keypath";
import { box, insert, remove, removeFrom, ring, rounded, set, type Item } from "./item";

/** Greatest distance at which obstacles of no thickness can be taken hold of. */
const THIN_M = 0.02;

/** The form in which places of a scenario are written: in so many numbers, and how finely. */
interface Script {
  dimensions: 2 | 3;
  m_per_px: number;
}

function pointOf(value: Json | undefined, { dimensions }: Script): Place | null {
  const numbers = numbersOf(value, dimensions);
  return numbers && numbers.length === dimensions ? [numbers[0]!, numbers[1]!, numbers[2] ?? 0] : null;
}

function pointsOf(value: Json | undefined, script: Script): Place[] {
  const points = Array.isArray(value) ? value.map((one) => pointOf(one, script)) : [];
  return points.every((one) => one !== null) ? points : [];
}

function written(at: Place, { dimensions, m_per_px }: Script): number[] {
  return at.slice(0, dimensions).map((number) => rounded(number, m_per_px));
}

/** A point that is moved alone. */
function handle(path: Path, words: string, kind: Item["kind"], at: Place, script: Script, removes: () => Edit[]): Item {
  return {
    path,
    words,
    kind,
    outline_m: [at],
    isClosed: false,
    at_m: at,
    move: (to) => [set(path, written(to, script))],
    remove: removes,
  };
}

/** Everything of a scenario of chains that has a place of its own. */
export function chainItems(model: Table, m_per_px: number, dimensions: 2 | 3 = 2): Item[] {
  const script = { dimensions, m_per_px };
  const obstacles = sectionsOf(model, "obstacles").flatMap(({ path, value }, i) =>
    obstacleItems(path, value, i, script),
  );
  const chains = sectionsOf(model, "chains").flatMap(({ path, value }, i) => startItems(path, value, i, script));
  return [...obstacles, ...chains];
}

function obstacleItems(path: Path, value: Table, number: number, script: Script): Item[] {
  const words = `obstacle ${number + 1}`;
  const gone = (): Edit[] => [remove(path)];
  const way = pointsOf(value["patrol_m"], script).map((at, i) =>
    handle([...path, "patrol_m", i], `way-point ${i + 1} of ${words}`, "goal", at, script, () =>
      removeFrom(path, "patrol_m", i, value),
    ),
  );
  const at = pointOf(value["at_m"], script);
  if (at) {
    const own: Item = {
      ...handle([...path, "at_m"], words, "body", at, script, gone),
      path,
      ...outlineOf(value, at, script),
    };
    return [own, ...way];
  }
  const key = value["ends_m"] !== undefined ? "ends_m" : "corners_m";
  const points = pointsOf(value[key], script);
  if (points.length < 2) return way;
  return [
    whole(path, key, words, points, key === "corners_m", script),
    ...corners(path, key, words, points, value, script),
    ...way,
  ];
}

/** The outline of a ball or a box: in space, its circles or its edges in one stroke. */
function outlineOf(value: Table, at: Place, { dimensions }: Script): Pick<Item, "outline_m" | "isClosed"> {
  const radius = Math.max(typeof value["radius_m"] === "number" ? value["radius_m"] : 0, THIN_M);
  const turn = typeof value["turn_deg"] === "number" ? (value["turn_deg"] * Math.PI) / 180 : 0;
  const sides = numbersOf(value["size_m"], dimensions);
  if (dimensions === 3) return { outline_m: sides ? cage(at, sides, turn) : globe(at, radius), isClosed: false };
  return { outline_m: sides ? box(at, sides[0]!, sides[1]!, turn) : ring(at, radius), isClosed: true };
}

/** The edges of a box in space, some of them twice. */
function cage([x, y, z]: Place, [width, depth, height]: readonly number[], turn_rad: number): Place[] {
  const flat = box([x, y, 0], width!, depth!, turn_rad);
  const corner = (k: number): Place => [flat[k % 4]![0], flat[k % 4]![1], z + (k < 4 ? -0.5 : 0.5) * height!];
  return [0, 1, 2, 3, 0, 4, 5, 1, 5, 6, 2, 6, 7, 3, 7, 4].map(corner);
}

/** Three circles of a ball, each from where the one before ends. */
function globe([x, y, z]: Place, radius_m: number): Place[] {
  const steps = 24;
  const circle = (u: 0 | 1 | 2, v: 0 | 1 | 2): Place[] =>
    Array.from({ length: steps + steps / 4 + 1 }, (_, i) => {
      const angle = (2 * Math.PI * i) / steps;
      const place: Place = [x, y, z];
      place[u] += radius_m * Math.cos(angle);
      place[v] += radius_m * Math.sin(angle);
      return place;
    });
  return [...circle(0, 1), ...circle(1, 2), ...circle(2, 0)];
}

/** A wall or a polygon as a whole: all of its points go the same way. */
function whole(path: Path, key: string, words: string, points: Place[], isClosed: boolean, script: Script): Item {
  const middle = [0, 1, 2].map((k) => points.reduce((sum, p) => sum + p[k]!, 0) / points.length) as Place;
  const moved = (p: Place, to: Place): Place => [
    p[0] + to[0] - middle[0],
    p[1] + to[1] - middle[1],
    p[2] + to[2] - middle[2],
  ];
  return {
    path,
    words,
    kind: "body",
    outline_m: points,
    isClosed,
    at_m: middle,
    move: (to) => [
      set(
        [...path, key],
        points.map((p) => written(moved(p, to), script)),
      ),
    ],
    remove: () => [remove(path)],
  };
}

function corners(path: Path, key: string, words: string, points: Place[], value: Table, script: Script): Item[] {
  const least = key === "ends_m" ? 2 : 3;
  return points.map((at, i) =>
    handle([...path, key, i], `corner ${i + 1} of ${words}`, "point", at, script, () =>
      points.length > least ? removeFrom(path, key, i, value) : [remove(path)],
    ),
  );
}

function startItems(path: Path, value: Table, number: number, script: Script): Item[] {
  const words = typeof value["name"] === "string" ? value["name"] : `chain ${number + 1}`;
  const at = pointOf(value["at_m"], script);
  const start = at ? [handle([...path, "at_m"], `start of ${words}`, "start", at, script, () => [remove(path)])] : [];
  const tasks = valueAt(value, ["tasks"]);
  const list = Array.isArray(tasks) ? tasks : tasks === undefined ? [] : [tasks];
  const targets = list.flatMap((task, t) => {
    const own = Array.isArray(tasks) ? [...path, "tasks", t] : [...path, "tasks"];
    return pointsOf(valueAt(task, ["targets_m"]), script).map((target, i) =>
      handle([...own, "targets_m", i], `target ${i + 1} of ${words}`, "goal", target, script, () =>
        removeFrom(own, "targets_m", i, task as Table),
      ),
    );
  });
  return [...start, ...targets];
}

/** A ball around a place; from a drag, as large as that. */
export function putBall(at: Place, radius_m: number, m_per_px: number): Edit[] {
  return [
    insert(["obstacles"], {
      at_m: [rounded(at[0], m_per_px), rounded(at[1], m_per_px)],
      radius_m: rounded(radius_m, m_per_px),
    }),
  ];
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
  const corners = pointsOf(host?.value["corners_m"], { dimensions: 2, m_per_px });
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
  const fits = ({ value }: { value: Table }): boolean =>
    value["at_m"] !== undefined && value["corners_m"] === undefined;
  const own = chosenObstacle(model, chosen);
  const host = own && fits(own) ? own : sectionsOf(model, "obstacles").filter(fits).at(-1);
  const from = host ? numbersOf(host.value["at_m"], 2) : null;
  if (!host || !from) return [];
  if (Array.isArray(host.value["patrol_m"])) return [insert([...host.path, "patrol_m"], place)];
  // A patrol takes the place of a straight way.
  const gone = ["bounces_m", "velocity_m_s"].filter((key) => host.value[key] !== undefined);
  return [
    ...gone.map((key) => remove([...host.path, key])),
    set([...host.path, "patrol_m"], [from, place]),
    set([...host.path, "speed_m_s"], 0.5),
  ];
}
