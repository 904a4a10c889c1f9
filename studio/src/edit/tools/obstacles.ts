/** Obstacles, starts and targets; tools that add new ones work in the plane only. */

import type { Edit, Point3 } from "../../protocol";
import { isWithin, numbersOf, sectionsOf, valueAt, type Json, type Path, type TomlTable } from "../keypath";
import { box, insert, remove, removeFrom, ring, roundTo, set, type Item } from "./item";

/** Minimum radius at which obstacles without thickness can be picked. */
const MIN_PICK_RADIUS_M = 0.02;

/** The format of positions in the scenario: number of coordinates and precision. */
export interface CoordinateFormat {
  dimensions: 2 | 3;
  m_per_px: number;
}

function pointOf(value: Json | undefined, { dimensions }: CoordinateFormat): Point3 | null {
  const numbers = numbersOf(value, dimensions);
  return numbers && numbers.length === dimensions ? [numbers[0]!, numbers[1]!, numbers[2] ?? 0] : null;
}

function pointsOf(value: Json | undefined, format: CoordinateFormat): Point3[] {
  const points = Array.isArray(value) ? value.map((one) => pointOf(one, format)) : [];
  return points.every((one) => one !== null) ? points : [];
}

function toCoordinates(at: Point3, { dimensions, m_per_px }: CoordinateFormat): number[] {
  return at.slice(0, dimensions).map((number) => roundTo(number, m_per_px));
}

/** A point that is moved on its own. */
function pointItem(
  path: Path,
  words: string,
  kind: Item["kind"],
  at: Point3,
  format: CoordinateFormat,
  removes: () => Edit[],
): Item {
  return {
    path,
    words,
    kind,
    outline_m: [at],
    isClosed: false,
    at_m: at,
    move: (to) => [set(path, toCoordinates(to, format))],
    remove: removes,
  };
}

/** All obstacles of a kind of sections, with their corners and patrols. */
export function obstacleItems(model: TomlTable, section: string, format: CoordinateFormat): Item[] {
  return sectionsOf(model, section).flatMap(({ path, value }, i) => itemsOfObstacle(path, value, i, format));
}

/** All starts of a kind of sections, with the targets of their tasks. */
export function startItems(model: TomlTable, section: string, noun: string, format: CoordinateFormat): Item[] {
  return sectionsOf(model, section).flatMap(({ path, value }, i) => {
    const words = typeof value["name"] === "string" ? value["name"] : `${noun} ${i + 1}`;
    return itemsOfStart(path, value, words, format);
  });
}

function itemsOfObstacle(path: Path, value: TomlTable, number: number, format: CoordinateFormat): Item[] {
  const words = `obstacle ${number + 1}`;
  const removal = (): Edit[] => [remove(path)];
  const patrol = pointsOf(value["patrol_m"], format).map((at, i) =>
    pointItem([...path, "patrol_m", i], `way-point ${i + 1} of ${words}`, "goal", at, format, () =>
      removeFrom(path, "patrol_m", i, value),
    ),
  );
  const at = pointOf(value["at_m"], format);
  if (at) {
    const own: Item = {
      ...pointItem([...path, "at_m"], words, "body", at, format, removal),
      path,
      ...outlineOf(value, at, format),
    };
    return [own, ...patrol];
  }
  const key = value["ends_m"] !== undefined ? "ends_m" : "corners_m";
  const points = pointsOf(value[key], format);
  if (points.length < 2) return patrol;
  return [
    outlineItem(path, key, words, points, key === "corners_m", format),
    ...cornerItems(path, key, words, points, value, format),
    ...patrol,
  ];
}

/** The outline of a ball or a box: in space, its circles or its edges as one polyline. */
function outlineOf(
  value: TomlTable,
  at: Point3,
  { dimensions }: CoordinateFormat,
): Pick<Item, "outline_m" | "isClosed"> {
  const radius = Math.max(typeof value["radius_m"] === "number" ? value["radius_m"] : 0, MIN_PICK_RADIUS_M);
  const turn = typeof value["turn_deg"] === "number" ? (value["turn_deg"] * Math.PI) / 180 : 0;
  const sides = numbersOf(value["size_m"], dimensions);
  if (dimensions === 3)
    return { outline_m: sides ? boxEdges(at, sides, turn) : sphereCircles(at, radius), isClosed: false };
  return { outline_m: sides ? box(at, sides[0]!, sides[1]!, turn) : ring(at, radius), isClosed: true };
}

/** The edges of a box in space, some of them twice. */
function boxEdges([x, y, z]: Point3, [width, depth, height]: readonly number[], turn_rad: number): Point3[] {
  const flat = box([x, y, 0], width!, depth!, turn_rad);
  const corner = (k: number): Point3 => [flat[k % 4]![0], flat[k % 4]![1], z + (k < 4 ? -0.5 : 0.5) * height!];
  return [0, 1, 2, 3, 0, 4, 5, 1, 5, 6, 2, 6, 7, 3, 7, 4].map(corner);
}

/** Three circles of a ball, each starting where the previous one ends. */
function sphereCircles([x, y, z]: Point3, radius_m: number): Point3[] {
  const steps = 24;
  const circle = (u: 0 | 1 | 2, v: 0 | 1 | 2): Point3[] =>
    Array.from({ length: steps + steps / 4 + 1 }, (_, i) => {
      const angle = (2 * Math.PI * i) / steps;
      const place: Point3 = [x, y, z];
      place[u] += radius_m * Math.cos(angle);
      place[v] += radius_m * Math.sin(angle);
      return place;
    });
  return [...circle(0, 1), ...circle(1, 2), ...circle(2, 0)];
}

/** A wall or a polygon as a whole: all its points move together. */
function outlineItem(
  path: Path,
  key: string,
  words: string,
  points: Point3[],
  isClosed: boolean,
  format: CoordinateFormat,
): Item {
  const middle = [0, 1, 2].map((k) => points.reduce((sum, p) => sum + p[k]!, 0) / points.length) as Point3;
  const moved = (p: Point3, to: Point3): Point3 => [
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
        points.map((p) => toCoordinates(moved(p, to), format)),
      ),
    ],
    remove: () => [remove(path)],
  };
}

function cornerItems(
  path: Path,
  key: string,
  words: string,
  points: Point3[],
  value: TomlTable,
  format: CoordinateFormat,
): Item[] {
  const minPoints = key === "ends_m" ? 2 : 3;
  return points.map((at, i) =>
    pointItem([...path, key, i], `corner ${i + 1} of ${words}`, "point", at, format, () =>
      points.length > minPoints ? removeFrom(path, key, i, value) : [remove(path)],
    ),
  );
}

function itemsOfStart(path: Path, value: TomlTable, words: string, format: CoordinateFormat): Item[] {
  const at = pointOf(value["at_m"], format);
  const start = at
    ? [pointItem([...path, "at_m"], `start of ${words}`, "start", at, format, () => [remove(path)])]
    : [];
  const tasks = valueAt(value, ["tasks"]);
  const list = Array.isArray(tasks) ? tasks : tasks === undefined ? [] : [tasks];
  const targets = list.flatMap((task, t) => {
    const own = Array.isArray(tasks) ? [...path, "tasks", t] : [...path, "tasks"];
    return pointsOf(valueAt(task, ["targets_m"]), format).map((target, i) =>
      pointItem([...own, "targets_m", i], `target ${i + 1} of ${words}`, "goal", target, format, () =>
        removeFrom(own, "targets_m", i, task as TomlTable),
      ),
    );
  });
  return [...start, ...targets];
}

/** Adds a ball around a position. */
export function putBall(section: string, at: Point3, radius_m: number, m_per_px: number): Edit[] {
  return [
    insert([section], {
      at_m: [roundTo(at[0], m_per_px), roundTo(at[1], m_per_px)],
      radius_m: roundTo(radius_m, m_per_px),
    }),
  ];
}

/** Adds a box between two corners. */
export function putBox(section: string, a: Point3, b: Point3, m_per_px: number): Edit[] {
  const round = (value: number): number => roundTo(value, m_per_px);
  const size_m = [round(Math.abs(b[0] - a[0])), round(Math.abs(b[1] - a[1]))];
  if (size_m.some((side) => side <= 0)) return [];
  return [insert([section], { at_m: [round((a[0] + b[0]) / 2), round((a[1] + b[1]) / 2)], size_m })];
}

/** Adds a wall from one position to another. */
export function putWall(section: string, a: Point3, b: Point3, m_per_px: number): Edit[] {
  const round = ([x, y]: Point3): number[] => [roundTo(x, m_per_px), roundTo(y, m_per_px)];
  if (Math.hypot(b[0] - a[0], b[1] - a[1]) < m_per_px) return [];
  return [insert([section], { ends_m: [round(a), round(b)], radius_m: 0.1 })];
}

/** The text that a tool edits, and what is selected in it. */
export interface ObstacleEdit {
  model: TomlTable;
  /** The sections of the obstacles. */
  section: string;
  chosen: Path | null;
  m_per_px: number;
}

/** The obstacle that a tool edits: the selected one, or that of the selected point. */
function chosenObstacle(
  model: TomlTable,
  section: string,
  chosen: Path | null,
): { path: Path; value: TomlTable } | undefined {
  return chosen ? sectionsOf(model, section).find(({ path }) => isWithin(chosen, path)) : undefined;
}

/** The distance of a position from a segment of an outline. */
function distance(at: Point3, a: Point3, b: Point3): number {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const along = ((at[0] - a[0]) * dx + (at[1] - a[1]) * dy) / (dx * dx + dy * dy || 1);
  const t = Math.min(1, Math.max(0, along));
  return Math.hypot(at[0] - a[0] - t * dx, at[1] - a[1] - t * dy);
}

/** The edge of a closed outline nearest to a position: the index of its second corner. */
function nearestEdge(at: Point3, corners: Point3[]): number {
  const distances = corners.map((corner, i) =>
    distance(at, corners[(i + corners.length - 1) % corners.length]!, corner),
  );
  const nearest = distances.indexOf(Math.min(...distances));
  return nearest === 0 ? corners.length : nearest;
}

/** Adds a corner to the selected polygon, in its nearest edge; else a triangle along the drag. */
export function putPolygon({ model, section, chosen, m_per_px }: ObstacleEdit, a: Point3, b: Point3): Edit[] {
  const round = ([x, y]: readonly number[]): number[] => [roundTo(x!, m_per_px), roundTo(y!, m_per_px)];
  const host = chosenObstacle(model, section, chosen);
  const corners = pointsOf(host?.value["corners_m"], { dimensions: 2, m_per_px });
  if (host && corners.length >= 3) {
    return [{ ...insert([...host.path, "corners_m"], round(b)), at: nearestEdge(b, corners) } as Edit];
  }
  if (Math.hypot(b[0] - a[0], b[1] - a[1]) < m_per_px) return [];
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  // The third corner lies to the left, so that all sides are about equally long.
  const third = [a[0] + 0.5 * dx - 0.8 * dy, a[1] + 0.5 * dy + 0.8 * dx];
  return [insert([section], { corners_m: [round(a), round(b), round(third)] })];
}

/** Adds a way-point to the selected obstacle's patrol; the first one makes it move there and back. */
export function putPatrol({ model, section, chosen, m_per_px }: ObstacleEdit, to: Point3): Edit[] {
  const place = [roundTo(to[0], m_per_px), roundTo(to[1], m_per_px)];
  const canPatrol = ({ value }: { value: TomlTable }): boolean =>
    value["at_m"] !== undefined && value["corners_m"] === undefined;
  const own = chosenObstacle(model, section, chosen);
  const host = own && canPatrol(own) ? own : sectionsOf(model, section).filter(canPatrol).at(-1);
  const from = host ? numbersOf(host.value["at_m"], 2) : null;
  if (!host || !from) return [];
  if (Array.isArray(host.value["patrol_m"])) return [insert([...host.path, "patrol_m"], place)];
  // A patrol replaces a straight motion.
  const replaced = ["bounces_m", "velocity_m_s"].filter((key) => host.value[key] !== undefined);
  return [
    ...replaced.map((key) => remove([...host.path, key])),
    set([...host.path, "patrol_m"], [from, place]),
    set([...host.path, "speed_m_s"], 0.5),
  ];
}
