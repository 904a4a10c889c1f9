/** Bodies, doors and way-points on the boxes of a floor. */

import type { Edit, Point3 } from "../../protocol";
import { cellOf, cornerPosition, type AsciiMap, type GridPlacement } from "../ascii-map";
import { rectangleCells, type Cell, type Rect } from "../cells";
import { numbersOf, sectionsOf, valueAt, type Path, type TomlTable } from "../keypath";
import { insert, remove, removeFrom, set, type Item } from "./item";

/** Sides in boxes of the bodies of a section: one number for a square. */
function sizeOf(section: TomlTable): [number, number] {
  const { size } = section;
  if (typeof size === "number") return [size, size];
  const sides = numbersOf(size, 2);
  return sides ? [sides[0]!, sides[1]!] : [1, 1];
}

/** Bodies with a position of their own. */
export interface BodySource {
  /** Their sections. */
  section: string;
  /** The noun for one of them. */
  noun: string;
  /** Whether they have headings. */
  turns: boolean;
}

/** All bodies of a kind of sections. */
export function bodyItems(model: TomlTable, source: BodySource, ground: GridPlacement): Item[] {
  return sectionsOf(model, source.section).flatMap(({ path, value }) => itemsOfSection(source, path, value, ground));
}

/** All way-points and areas of a kind of sections. */
export function goalItems(model: TomlTable, section: string, ground: GridPlacement): Item[] {
  return sectionsOf(model, section).flatMap(({ path, value }) => goalsOfSection(path, value, ground));
}

function outlineOf(ground: GridPlacement, { column, row, width, height }: Rect): Point3[] {
  const corner = (c: number, r: number): Point3 => cornerPosition(ground, column + c, row + r);
  return [corner(0, 0), corner(width, 0), corner(width, height), corner(0, height)];
}

/** The lower-left box of a body of this size centered near a position. */
function anchor(ground: GridPlacement, [x, y]: Point3, [width, height]: [number, number]): Cell {
  const [dx, dy] = [((width - 1) / 2) * ground.box_m, ((height - 1) / 2) * ground.box_m];
  const [c, s] = [Math.cos(ground.yaw_rad), Math.sin(ground.yaw_rad)];
  return cellOf(ground, x - c * dx + s * dy + 1e-9, y - s * dx - c * dy + 1e-9);
}

function itemsOfSection({ noun, turns }: BodySource, section: Path, value: TomlTable, ground: GridPlacement): Item[] {
  const size = sizeOf(value);
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
        words: `${noun}${name} at column ${column}, row ${row}`,
        kind: "body",
        outline_m: outlineOf(ground, rect),
        isClosed: true,
        at_m: cornerPosition(ground, column + size[0] / 2, row + size[1] / 2),
        move: (to) => [set(path, [...anchor(ground, to, size), ...(heading === undefined ? [] : [heading])])],
        remove: () => removeFrom(section, "at", i, value),
        ...(turns ? { turn: () => [set(path, [column, row, ((heading ?? -1) + 1) % 4])] } : {}),
      },
    ];
  });
}

/** Goals, ends of shuttles, and regions for random positions. */
function goalsOfSection(section: Path, value: TomlTable, ground: GridPlacement): Item[] {
  const name =
    typeof value["name"] === "string" && value["name"] !== ""
      ? value["name"]
      : `${section[0]} ${Number(section[1] ?? 0) + 1}`;
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
        at_m: cornerPosition(ground, column + 0.5, row + 0.5),
        move: (to) => [set(path, [...cellOf(ground, to[0], to[1])])],
        remove: () => (Array.isArray(goals) && goals.length === 1 ? [remove(behaviour)] : [remove(path)]),
      },
    ];
  });
  const areas = [["behaviour", "a"], ["behaviour", "b"], ["region"]].flatMap((below) =>
    areaItem(section, below, value, name, ground),
  );
  return [...areas, ...points];
}

function areaItem(section: Path, below: string[], value: TomlTable, name: string, ground: GridPlacement): Item[] {
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
      at_m: cornerPosition(ground, column + width / 2, row + height / 2),
      move: (to) => [set(path, [...anchor(ground, to, [width, height]), width, height])],
      remove: () => [remove(below.at(-1) === "region" ? path : [...section, "behaviour"])],
    },
  ];
}

/** The section that a new body is added to: the selected one, else the last one with explicit positions. */
function targetSection(model: TomlTable, key: string, chosen: Path | null): { path: Path; value: TomlTable } | null {
  const hosts = sectionsOf(model, key).filter(
    ({ value }) => Array.isArray(value["at"]) && value["count"] === undefined,
  );
  return hosts.find(({ path }) => chosen && path.every((part, i) => part === chosen[i])) ?? hosts.at(-1) ?? null;
}

/** A kind of sections, and the other keys of a new one. */
export interface SectionTemplate {
  section: string;
  template: TomlTable;
}

/** The edits that add a body with its lower-left box at a cell. */
export function putBody(
  model: TomlTable,
  { section, template }: SectionTemplate,
  cell: Cell,
  chosen: Path | null,
): Edit[] {
  const host = targetSection(model, section, chosen);
  if (host) return [insert([...host.path, "at"], [...cell])];
  return [insert([section], { ...template, at: [[...cell]] })];
}

/** The edits that add a door in a rectangle, and clear the walls there. */
export function putDoor(
  model: TomlTable,
  { section, template }: SectionTemplate,
  map: AsciiMap | null,
  { column, row, width, height }: Rect,
): Edit[] {
  const clearing = map?.paint(rectangleCells([column, row], [column + width - 1, row + height - 1], true), ".");
  const sameSize = sectionsOf(model, section).find(({ value }) => {
    const [w, h] = sizeOf(value);
    return Array.isArray(value["at"]) && w === width && h === height;
  });
  const door = sameSize
    ? insert([...sameSize.path, "at"], [column, row])
    : insert([section], { at: [[column, row]], size: [width, height], ...template });
  return clearing ? [clearing, door] : [door];
}

/** The edits that add a way-point to the selected bodies, else to the first. */
export function putGoal(model: TomlTable, section: string, cell: Cell, chosen: Path | null): Edit[] {
  const all = sectionsOf(model, section);
  const { path, value } = all.find((one) => chosen && one.path.every((part, i) => part === chosen[i])) ?? all[0] ?? {};
  if (!path || !value) return [];
  const goals = valueAt(value, ["behaviour", "goals"]);
  if (Array.isArray(goals)) return [insert([...path, "behaviour", "goals"], [...cell])];
  return [set([...path, "behaviour"], { kind: "goto", goals: [[...cell]], repeat: true })];
}

/** The lower-left box of a body centered on a box, so that it is around the pointer. */
export function lowerLeftAround([column, row]: Cell, side: number): Cell {
  const offset = Math.floor((side - 1) / 2);
  return [column - offset, row - offset];
}

/** Side of the bodies that the tool would add. */
export function sideOfNewBody(model: TomlTable, section: string, chosen: Path | null): number {
  const host = targetSection(model, section, chosen);
  return host ? sizeOf(host.value)[0] : 2;
}
