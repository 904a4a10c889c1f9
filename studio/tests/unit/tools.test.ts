import { describe, expect, test } from "vitest";
import { dragAlong, axisAt, handlesAt } from "../../src/edit/axes";
import { AsciiMap, placementOf } from "../../src/edit/ascii-map";
import type { TomlTable } from "../../src/edit/keypath";
import { toolsOf } from "../../src/edit/editing";
import { bodyItems, goalItems, lowerLeftAround, putBody, putDoor, putGoal } from "../../src/edit/tools/boxes";
import {
  obstacleItems,
  putBall,
  putBox,
  putPatrol,
  putPolygon,
  putWall,
  startItems,
} from "../../src/edit/tools/obstacles";
import { pointItems, putPoint } from "../../src/edit/tools/points";
import { headingTo, putRoute, putWayPoint, routeItems } from "../../src/edit/tools/routes";
import { SpaceCamera } from "../../src/scene/camera";
import type { Item } from "../../src/edit/tools/item";
import type { Scene } from "../../src/protocol";
import { declaredEditing } from "../fake/editing";

const map = new AsciiMap("######\n#....#\n#....#\n######\n", 0.5);
const ground = placementOf(map, null)!;

/** The section and the template of a tool that adds a body. */
function templateOf(id: string): { section: string; template: TomlTable } {
  const { action } = declaredEditing("robots").tools.find((tool) => tool.id === id)!;
  if (action.do !== "add-body" && action.do !== "add-door") throw new Error(`${id} adds no body`);
  return action;
}

/** All items of a world without boxes. */
function itemsIn(world: string, model: TomlTable, m_per_px: number, dimensions: 2 | 3 = 2): Item[] {
  return declaredEditing(world).items.flatMap((source) => {
    const format = { dimensions, m_per_px };
    if (source.of === "obstacles") return obstacleItems(model, source.section, format);
    if (source.of === "starts") return startItems(model, source.section, source.noun, format);
    return source.of === "routes" ? routeItems(model, source.section, source.noun, m_per_px) : [];
  });
}

describe("robots", () => {
  const model: TomlTable = {
    robots: [
      {
        at: [
          [1, 1],
          [3, 1, 2],
        ],
        size: 2,
        behaviour: { kind: "goto", goals: [[4, 2]] },
      },
      { count: 3, region: [1, 1, 4, 2] },
    ],
    people: { at: [[1, 2]], size: [1, 2] },
  };
  const items = declaredEditing("robots").items.flatMap((source) => {
    if (source.of === "goals") return goalItems(model, source.section, ground);
    return source.of === "bodies" ? bodyItems(model, source, ground) : [];
  });
  const item = (key: string) => items.find(({ path }) => path.join(".") === key)!;

  test("are placed around the middle of their boxes", () => {
    expect(item("robots.0.at.0").at_m).toEqual([1, 1, 0]);
    expect(item("robots.0.at.0").outline_m).toEqual([
      [0.5, 0.5, 0],
      [1.5, 0.5, 0],
      [1.5, 1.5, 0],
      [0.5, 1.5, 0],
    ]);
    expect(item("people.at.0").at_m).toEqual([0.75, 1.5, 0]);
    expect(item("robots.0.behaviour.goals.0").at_m).toEqual([2.25, 1.25, 0]);
    expect(items.length).toBe(5);
  });

  test("move by whole boxes and keep their headings", () => {
    expect(item("robots.0.at.0").move([1.3, 1.2, 0])).toEqual([{ op: "set", key: "robots.0.at.0", value: [2, 1] }]);
    expect(item("robots.0.at.0").move([1, 1, 0])).toEqual([{ op: "set", key: "robots.0.at.0", value: [1, 1] }]);
    expect(item("robots.0.at.1").move([1, 1, 0])).toEqual([{ op: "set", key: "robots.0.at.1", value: [1, 1, 2] }]);
    expect(item("robots.1.region").move([2, 1, 0])).toEqual([
      { op: "set", key: "robots.1.region", value: [2, 1, 4, 2] },
    ]);
  });

  test("rotate by 90 degrees, from east", () => {
    expect(item("robots.0.at.0").turn!()).toEqual([{ op: "set", key: "robots.0.at.0", value: [1, 1, 0] }]);
    expect(item("robots.0.at.1").turn!()).toEqual([{ op: "set", key: "robots.0.at.1", value: [3, 1, 3] }]);
  });

  test("are removed alone, and the last of a section with the section", () => {
    expect(item("robots.0.at.0").remove()).toEqual([{ op: "remove", key: "robots.0.at.0" }]);
    expect(item("people.at.0").remove()).toEqual([{ op: "remove", key: "people" }]);
  });

  test("are added to the section of the selected one, unless it is given by a count", () => {
    expect(putBody(model, templateOf("robot"), [2, 2], null)).toEqual([
      { op: "insert", key: "robots.0.at", at: null, value: [2, 2] },
    ]);
    const [first] = putBody({ robots: { count: 4 } }, templateOf("robot"), [2, 2], null);
    expect(first).toMatchObject({ op: "insert", key: "robots", value: { at: [[2, 2]], size: 2 } });
    expect(lowerLeftAround([5, 5], 2)).toEqual([5, 5]);
    expect(lowerLeftAround([5, 5], 3)).toEqual([4, 4]);
  });

  test("a door removes the wall that it is in, and joins the section of its size", () => {
    const rect = { column: 5, row: 1, width: 1, height: 2 };
    const [way, door] = putDoor(model, templateOf("door"), map, rect);
    expect(way).toEqual({
      op: "paint",
      key: "map.ascii",
      cells: [
        [2, 5, "."],
        [1, 5, "."],
      ],
    });
    expect(door).toMatchObject({ op: "insert", key: "doors", value: { at: [[5, 1]], size: [1, 2] } });
    const more = putDoor({ doors: { at: [[0, 1]], size: [1, 2] } }, templateOf("door"), map, rect);
    expect(more[1]).toEqual({ op: "insert", key: "doors.at", at: null, value: [5, 1] });
  });

  test("a way-point is added to the goals, or becomes the first goal", () => {
    expect(putGoal(model, "robots", [2, 1], null)).toEqual([
      { op: "insert", key: "robots.0.behaviour.goals", at: null, value: [2, 1] },
    ]);
    expect(putGoal(model, "robots", [2, 1], ["robots", 1])).toEqual([
      { op: "set", key: "robots.1.behaviour", value: { kind: "goto", goals: [[2, 1]], repeat: true } },
    ]);
  });
});

/** The text that a tool edits. */
function at(section: string, model: TomlTable, chosen: (string | number)[] | null, m_per_px = 0.01) {
  return { model, section, chosen, m_per_px };
}

describe("chains", () => {
  const model: TomlTable = {
    obstacles: [
      { at_m: [4, 1.5], radius_m: 0.5 },
      {
        ends_m: [
          [2, -2],
          [5, -1],
        ],
        radius_m: 0.2,
      },
      { at_m: [7, 1], size_m: [2, 1], turn_deg: 90 },
      {
        corners_m: [
          [0, 0],
          [1, 0],
          [0, 1],
        ],
      },
    ],
    chains: { at_m: [0, 0], tasks: [{ kind: "targets", targets_m: [[12, 0]] }] },
  };
  const items = itemsIn("chain", model, 0.01);
  const item = (key: string) => items.find(({ path }) => path.join(".") === key)!;

  test("balls, walls, boxes, polygons, starts and targets can be picked", () => {
    expect(item("obstacles.0").at_m).toEqual([4, 1.5, 0]);
    expect(item("obstacles.1").at_m).toEqual([3.5, -1.5, 0]);
    expect(item("obstacles.1.ends_m.1").at_m).toEqual([5, -1, 0]);
    expect(item("obstacles.2").outline_m[0]!.map((v) => Math.abs(Math.round(v * 100) / 100))).toEqual([7.5, 0, 0]);
    expect(item("obstacles.3.corners_m.2").at_m).toEqual([0, 1, 0]);
    expect(item("chains.at_m").words).toBe("start of chain 1");
    expect(item("chains.tasks.0.targets_m.0").at_m).toEqual([12, 0, 0]);
  });

  test("a wall moves as a whole, and an end moves alone", () => {
    expect(item("obstacles.1").move([4.5, -1.5, 0])).toEqual([
      {
        op: "set",
        key: "obstacles.1.ends_m",
        value: [
          [3, -2],
          [6, -1],
        ],
      },
    ]);
    expect(item("obstacles.1.ends_m.0").move([2.004, -2.5, 0])).toEqual([
      { op: "set", key: "obstacles.1.ends_m.0", value: [2, -2.5] },
    ]);
    expect(item("obstacles.0").move([1, 1, 0])).toEqual([{ op: "set", key: "obstacles.0.at_m", value: [1, 1] }]);
  });

  test("removing a corner of a triangle removes the triangle", () => {
    expect(item("obstacles.3.corners_m.0").remove()).toEqual([{ op: "remove", key: "obstacles.3" }]);
    expect(item("chains.tasks.0.targets_m.0").remove()).toEqual([{ op: "remove", key: "chains.tasks.0" }]);
  });

  test("new obstacles are written with short numbers", () => {
    expect(putBall("obstacles", [1.23456, 2, 0], 0.5, 0.01)).toEqual([
      { op: "insert", key: "obstacles", at: null, value: { at_m: [1.23, 2], radius_m: 0.5 } },
    ]);
    expect(putWall("obstacles", [0, 0, 0], [1, 1, 0], 0.01)[0]).toMatchObject({
      value: {
        ends_m: [
          [0, 0],
          [1, 1],
        ],
      },
    });
    expect(putBox("obstacles", [0, 2, 0], [1, 0, 0], 0.01)[0]).toMatchObject({
      value: { at_m: [0.5, 1], size_m: [1, 2] },
    });
    expect(putBox("obstacles", [0, 0, 0], [1, 0, 0], 0.01)).toEqual([]);
    expect(putWall("obstacles", [0, 0, 0], [0, 0, 0], 0.01)).toEqual([]);
  });

  test("a polygon starts as a triangle, and a new corner splits the nearest edge", () => {
    const [triangle] = putPolygon(at("obstacles", model, null), [0, 0, 0], [2, 0, 0]);
    expect(triangle).toEqual({
      op: "insert",
      key: "obstacles",
      at: null,
      value: {
        corners_m: [
          [0, 0],
          [2, 0],
          [1, 1.6],
        ],
      },
    });
    expect(putPolygon(at("obstacles", model, null), [0, 0, 0], [0, 0, 0])).toEqual([]);
    const corner = (x: number, y: number) =>
      putPolygon(at("obstacles", model, ["obstacles", 3, "corners_m", 1]), [x, y, 0], [x, y, 0]);
    expect(corner(0.5, -0.2)).toEqual([{ op: "insert", key: "obstacles.3.corners_m", at: 1, value: [0.5, -0.2] }]);
    expect(corner(0.7, 0.7)).toMatchObject([{ at: 2 }]);
    expect(corner(-0.3, 0.5)).toMatchObject([{ at: 3 }]);
  });

  test("a patrol starts at the obstacle, grows with each click, and replaces a velocity", () => {
    expect(putPatrol(at("obstacles", model, ["obstacles", 0]), [5, 2, 0])).toEqual([
      {
        op: "set",
        key: "obstacles.0.patrol_m",
        value: [
          [4, 1.5],
          [5, 2],
        ],
      },
      { op: "set", key: "obstacles.0.speed_m_s", value: 0.5 },
    ]);
    const moving: TomlTable = {
      obstacles: {
        at_m: [1, 1],
        radius_m: 1,
        patrol_m: [
          [1, 1],
          [2, 2],
        ],
      },
    };
    expect(putPatrol(at("obstacles", moving, null), [3, 3, 0])).toEqual([
      { op: "insert", key: "obstacles.patrol_m", at: null, value: [3, 3] },
    ]);
    const straight: TomlTable = {
      obstacles: [
        { at_m: [1, 1], velocity_m_s: [1, 0] },
        {
          ends_m: [
            [0, 0],
            [1, 1],
          ],
        },
      ],
    };
    expect(putPatrol(at("obstacles", straight, ["obstacles", 1]), [3, 3, 0]).map((edit) => edit.op)).toEqual([
      "remove",
      "set",
      "set",
    ]);
    expect(
      putPatrol(
        at(
          "obstacles",
          {
            obstacles: {
              ends_m: [
                [0, 0],
                [1, 1],
              ],
            },
          },
          null,
        ),
        [3, 3, 0],
      ),
    ).toEqual([]);
  });
});

describe("chains in space", () => {
  const model: TomlTable = {
    obstacles: [
      { at_m: [1, 2, 3], radius_m: 0.5 },
      { at_m: [0, 0, 1], size_m: [2, 4, 6], turn_deg: 90 },
      {
        ends_m: [
          [0, 0, 0],
          [2, 0, 4],
        ],
        radius_m: 0.1,
      },
    ],
    chains: { at_m: [0, 0, 1], tasks: [{ kind: "reach", targets_m: [[5, 6, 7]] }] },
  };
  const items = itemsIn("chain", model, 0.01, 3);
  const item = (key: string): (typeof items)[number] => items.find(({ path }) => path.join(".") === key)!;

  test("positions keep three coordinates when moved", () => {
    expect(item("obstacles.0").move([1.504, 2, 3.25])).toEqual([
      { op: "set", key: "obstacles.0.at_m", value: [1.5, 2, 3.25] },
    ]);
    expect(item("obstacles.2").move([2, 0, 3])).toEqual([
      {
        op: "set",
        key: "obstacles.2.ends_m",
        value: [
          [1, 0, 1],
          [3, 0, 5],
        ],
      },
    ]);
    expect(item("obstacles.2.ends_m.1").move([2, 1, 4])).toEqual([
      { op: "set", key: "obstacles.2.ends_m.1", value: [2, 1, 4] },
    ]);
    expect(item("chains.at_m").move([0, 0, 2])).toEqual([{ op: "set", key: "chains.at_m", value: [0, 0, 2] }]);
    expect(item("chains.tasks.0.targets_m.0").move([5, 6, 8])).toEqual([
      { op: "set", key: "chains.tasks.0.targets_m.0", value: [5, 6, 8] },
    ]);
  });

  test("outlines enclose the body, and positions with two coordinates have none in space", () => {
    const reach = (key: string, k: number): number[] =>
      [Math.min, Math.max].map((most) => Number(most(...item(key).outline_m.map((p) => p[k]!)).toFixed(9)));
    expect([0, 1, 2].map((k) => reach("obstacles.0", k))).toEqual([
      [0.5, 1.5],
      [1.5, 2.5],
      [2.5, 3.5],
    ]);
    expect([0, 1, 2].map((k) => reach("obstacles.1", k))).toEqual([
      [-2, 2],
      [-1, 1],
      [-2, 4],
    ]);
    expect(itemsIn("chain", { obstacles: [{ at_m: [1, 2], radius_m: 1 }] }, 0.01, 3)).toEqual([]);
  });

  test("a handle moves only its own coordinate, by the pointer's distance along the axis", () => {
    const camera = new SpaceCamera();
    camera.resize(800, 600);
    camera.fit({ low: [-2, -2, -2], high: [2, 2, 2] });
    const at = [0.5, 0.25, 0] as [number, number, number];
    const handles = handlesAt(camera, at);
    expect(handles.map(({ axis }) => axis)).toEqual([0, 1, 2]);
    for (const { axis, tip_m } of handles) {
      const [[x, y], [tx, ty]] = [camera.project(...at), camera.project(...tip_m)];
      expect(axisAt(camera, at, tx, ty)).toBe(axis);
      const by = dragAlong(camera, at, axis, tx - x, ty - y);
      expect(by[axis]).toBeCloseTo(tip_m[axis] - at[axis], 9);
      expect(by.filter((part) => part !== 0)).toHaveLength(1);
      const [px, py] = camera.project(...tip_m);
      camera.unproject(px, py, tip_m).forEach((part, k) => expect(part).toBeCloseTo(tip_m[k]!, 4));
    }
    expect(axisAt(camera, at, 0, 0)).toBeNull();
  });
});

describe("airplanes", () => {
  const model: TomlTable = {
    airplanes: [
      {
        callsign: "ONE1",
        at_m: [-5000, 0],
        heading_deg: 0,
        way_points_m: [
          [0, 500],
          [5000, 0],
        ],
      },
      { track: [[0, 0, 0, 0]] },
    ],
  };

  test("have starts and way-points; recorded ones have none", () => {
    const items = itemsIn("airspace", model, 20);
    expect(items.map(({ path }) => path.join("."))).toEqual([
      "airplanes.0",
      "airplanes.0.way_points_m.0",
      "airplanes.0.way_points_m.1",
    ]);
    expect(items[1]!.move([100.4, 400, 0])).toEqual([
      { op: "set", key: "airplanes.0.way_points_m.0", value: [100, 400] },
    ]);
    expect(items[0]!.turn!()).toEqual([{ op: "set", key: "airplanes.0.heading_deg", value: 90 }]);
  });

  test("fly from the start of the drag to its end, with headings counterclockwise from east", () => {
    expect(headingTo([0, 0, 0], [0, 10, 0])).toBe(90);
    expect(headingTo([0, 0, 0], [-10, 0, 0])).toBe(180);
    expect(putRoute("airplanes", [0, 0, 0], [0, 3000.4, 0], 20)).toEqual([
      { op: "insert", key: "airplanes", at: null, value: { at_m: [0, 0], heading_deg: 90, way_points_m: [[0, 3000]] } },
    ]);
  });

  test("a way-point is added to the selected airplane, else to the last that is not recorded", () => {
    expect(putWayPoint(at("airplanes", model, null, 1), [1, 2, 0])).toEqual([
      { op: "insert", key: "airplanes.0.way_points_m", at: null, value: [1, 2] },
    ]);
    expect(putWayPoint(at("airplanes", {}, null, 1), [1, 2, 0])).toEqual([]);
  });
});

describe("a world that the page does not know", () => {
  test("has points that are added, moved and removed", () => {
    const model: TomlTable = { reeds: [{ at_m: [1.5, 2.5] }, {}] };
    const [reed, ...others] = pointItems(model, "reeds", "reed", 0.01);
    expect(others).toEqual([]);
    expect([reed!.words, reed!.at_m]).toEqual(["reed 1", [1.5, 2.5, 0]]);
    expect(reed!.move([2.004, 1, 0])).toEqual([{ op: "set", key: "reeds.0.at_m", value: [2, 1] }]);
    expect(reed!.remove()).toEqual([{ op: "remove", key: "reeds.0" }]);
    expect(putPoint("reeds", [3.5, 0.5, 0], 0.01)).toEqual([
      { op: "insert", key: "reeds", at: null, value: { at_m: [3.5, 0.5] } },
    ]);
  });

  test("has the tools that it declares, in space others than in the plane", () => {
    const ids = (world: string, dimensions: number): string[] =>
      toolsOf(declaredEditing(world), { dimensions } as Scene).map(({ id }) => id);
    expect(ids("airspace", 2)).toEqual(["select", "airplane", "way-point"]);
    expect(ids("airspace", 3)).toEqual([]);
    expect(ids("chain", 3)).toEqual(["select"]);
  });
});
