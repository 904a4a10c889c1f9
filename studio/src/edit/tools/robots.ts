/** Robots, people, doors and way-points on the boxes of a floor. */

import type { Edit, Place } from "../../protocol";
import { cellOf, placeOf, type Board, type Ground } from "../board";
import { rectangleCells, type Cell, type Rect } from "../cells";
import { numbersOf, sectionsOf, valueAt, type Path, type Table } from "../keypath";
import { insert, remove, removeFrom, set, type Item } from "./item";

/** Sides in boxes of the bodies of a section. */
function sizeOf(key: string, section: Table): [number, number] {
  const { size } = section;
  if (key === "robots") return typeof size === "number" ? [size, size] : [1, 1];
  const sides = numbersOf(size, 2);
  return sides ? [sides[0]!, sides[1]!] : [1, 1];
}

const ONE: Record<string, string> = { robots: "robot", people: "person", doors: "door" };

/** Everything of a scenario of robots that has a place of its own. */
export function robotItems(model: Table, ground: Ground): Item[] {
  const bodies = ["robots", "people", "doors"].flatMap((key) =>
    sectionsOf(model, key).flatMap(({ path, value }) => bodiesOf(key, path, value, ground)),
  );
  const aims = sectionsOf(model, "robots").flatMap(({ path, value }) => aimsOf(path, value, ground));
  return [...aims, ...bodies];
}

function outlineOf(ground: Ground, { column, row, width, height }: Rect): Place[] {
  const corner = (c: number, r: number): Place => placeOf(ground, column + c, row + r);
  return [corner(0, 0), corner(width, 0), corner(width, height), corner(0, height)];
}

/** The box whose body of this size has its middle near a place. */
function anchor(ground: Ground, [x, y]: Place, [width, height]: [number, number]): Cell {
  const [dx, dy] = [((width - 1) / 2) * ground.box_m, ((height - 1) / 2) * ground.box_m];
  const [c, s] = [Math.cos(ground.yaw_rad), Math.sin(ground.yaw_rad)];
  return cellOf(ground, x - c * dx + s * dy + 1e-9, y - s * dx - c * dy + 1e-9);
}

function bodiesOf(key: string, section: Path, value: Table, ground: Ground): Item[] {
  const size = sizeOf(key, value);
  const name = typeof value["name"] === "string" && value["name"] !== "" ? ` (${value["name"]})` : "";
  const list = Array.isArray(value["at"]) ? value["at"] : [];
  return list.flatMap((given, i): Item[] => {
    const at = numbersOf(given, 2);
    if (!at) return [];
    const path = [...section, "at", i];
    const [column, row, heading] = at as [number, number, number | undefined];
    const rect = { column, row, width: size[0], height: size[1] };
    return [
      {
        path,
        words: `${ONE[key]}${name} at column ${column}, row ${row}`,
        kind: "body",
        outline_m: outlineOf(ground, rect),
        isClosed: true,
        at_m: placeOf(ground, column + size[0] / 2, row + size[1] / 2),
        move: (to) => [set(path, [...anchor(ground, to, size), ...(heading === undefined ? [] : [heading])])],
        remove: () => removeFrom(section, "at", i, value),
        ...(key === "robots" ? { turn: () => [set(path, [column, row, ((heading ?? -1) + 1) % 4])] } : {}),
      },
    ];
  });
}

/** Goals, ends of shuttles, and regions in which places are drawn. */
function aimsOf(section: Path, value: Table, ground: Ground): Item[] {
  const name =
    typeof value["name"] === "string" && value["name"] !== "" ? value["name"] : `robots ${Number(section[1] ?? 0) + 1}`;
  const behaviour = [...section, "behaviour"];
  const goals = valueAt(value, ["behaviour", "goals"]);
  const points = (Array.isArray(goals) ? goals : []).flatMap((given, i): Item[] => {
    const at = numbersOf(given, 2);
    if (!at) return [];
    const [column, row] = at as [number, number];
    const path = [...behaviour, "goals", i];
    return [
      {
        path,
        words: `way-point ${i + 1} of ${name}`,
        kind: "goal",
        outline_m: outlineOf(ground, { column, row, width: 1, height: 1 }),
        isClosed: true,
        at_m: placeOf(ground, column + 0.5, row + 0.5),
        move: (to) => [set(path, [...cellOf(ground, to[0], to[1])])],
        remove: () => (Array.isArray(goals) && goals.length === 1 ? [remove(behaviour)] : [remove(path)]),
      },
    ];
  });
  const areas = [["behaviour", "a"], ["behaviour", "b"], ["region"]].flatMap((below) =>
    area(section, below, value, name, ground),
  );
  return [...areas, ...points];
}

function area(section: Path, below: string[], value: Table, name: string, ground: Ground): Item[] {
  const given = numbersOf(valueAt(value, below), 4);
  if (!given) return [];
  const [column, row, width, height] = given as [number, number, number, number];
  const path = [...section, ...below];
  const word = below.at(-1) === "region" ? "region" : `end ${below.at(-1)}`;
  return [
    {
      path,
      words: `${word} of ${name}`,
      kind: "area",
      outline_m: outlineOf(ground, { column, row, width, height }),
      isClosed: true,
      at_m: placeOf(ground, column + width / 2, row + height / 2),
      move: (to) => [set(path, [...anchor(ground, to, [width, height]), width, height])],
      remove: () => [remove(below.at(-1) === "region" ? path : [...section, "behaviour"])],
    },
  ];
}

const FIRST: Record<string, Table> = {
  robots: { size: 2, sensors: ["sonar-ring"], effector: "nomad", behaviour: { kind: "wander" } },
  people: { size: [2, 2], period: 3 },
  doors: { periodic: { open: 60, closed: 20 } },
};

/** A section with places of its own to put one more body into: the chosen one, else the last. */
export function hostOf(model: Table, key: string, chosen: Path | null): { path: Path; value: Table } | null {
  const hosts = sectionsOf(model, key).filter(
    ({ value }) => Array.isArray(value["at"]) && value["count"] === undefined,
  );
  return hosts.find(({ path }) => chosen && path.every((part, i) => part === chosen[i])) ?? hosts.at(-1) ?? null;
}

/** The edits that put a body with its lower-left box there. */
export function putBody(model: Table, key: "robots" | "people", cell: Cell, chosen: Path | null): Edit[] {
  const host = hostOf(model, key, chosen);
  if (host) return [insert([...host.path, "at"], [...cell])];
  return [insert([key], { ...FIRST[key]!, at: [[...cell]] })];
}

/** The edits that put a door into a rectangle, and take walls out of its way. */
export function putDoor(model: Table, board: Board | null, { column, row, width, height }: Rect): Edit[] {
  const way = board?.paint(rectangleCells([column, row], [column + width - 1, row + height - 1], true), ".");
  const alike = sectionsOf(model, "doors").find(({ value }) => {
    const [w, h] = sizeOf("doors", value);
    return Array.isArray(value["at"]) && w === width && h === height;
  });
  const door = alike
    ? insert([...alike.path, "at"], [column, row])
    : insert(["doors"], { at: [[column, row]], size: [width, height], ...FIRST["doors"]! });
  return way ? [way, door] : [door];
}

/** The edits that give robots one more way-point: the chosen ones, else the first. */
export function putGoal(model: Table, cell: Cell, chosen: Path | null): Edit[] {
  const all = sectionsOf(model, "robots");
  const { path, value } = all.find((one) => chosen && one.path.every((part, i) => part === chosen[i])) ?? all[0] ?? {};
  if (!path || !value) return [];
  const goals = valueAt(value, ["behaviour", "goals"]);
  if (Array.isArray(goals)) return [insert([...path, "behaviour", "goals"], [...cell])];
  return [set([...path, "behaviour"], { kind: "goto", goals: [[...cell]], repeat: true })];
}

/** The lower-left box of a body whose middle is in a box, so that it lies around the pointer. */
export function around([column, row]: Cell, side: number): Cell {
  const before = Math.floor((side - 1) / 2);
  return [column - before, row - before];
}

/** Side of the robots that the tool would put. */
export function robotSide(model: Table, key: "robots" | "people", chosen: Path | null): number {
  const host = hostOf(model, key, chosen);
  return host ? sizeOf(key, host.value)[0] : 2;
}
