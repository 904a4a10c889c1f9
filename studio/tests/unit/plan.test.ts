/** The plan view of traffic: places on earth, lines of latitude and longitude, units, data blocks and areas. */

import { describe, expect, test } from "vitest";
import type { Traffic } from "../../src/protocol";
import { PlaneCamera } from "../../src/scene/camera";
import { crosses, isDisjoint, placeBlocks, type BlockRequest, type LastPlaces } from "../../src/scene/data-blocks";
import { latLonDeg } from "../../src/scene/earth";
import { angleLabel, graticule } from "../../src/scene/graticule";
import { levelRange, lookahead_s, unitsOf, verticalSymbol } from "../../src/scene/plan-units";
import { polygonsOf } from "../../src/scene/traffic-areas";

const ROUND = { origin_deg: [52, 179.9] as [number, number], sphere_radius_m: null };
const TRAFFIC: Traffic = { chart: ROUND, level_m: null, areas: [], routes: [] };

describe("places on earth", () => {
  test("are those of the program", () => {
    // The numbers of the kernel's own test of a chart.
    expect(latLonDeg(ROUND, 0, 0)).toEqual([52, 179.9]);
    const [lat, lon] = latLonDeg(ROUND, 50_000, 0);
    expect(lat).toBeLessThan(52);
    expect(lat).toBeGreaterThan(51.99);
    expect(lon).toBeCloseTo(-179.372, 2);
    const flat = latLonDeg({ ...ROUND, sphere_radius_m: 6_371_000 }, 50_000, 111_194.9);
    expect(flat[0]).toBeCloseTo(53, 4);
    expect(flat[1]).toBeCloseTo(-179.37, 2);
  });

  test("north of the equator a degree of latitude is 110.6 km, of longitude 111.3 km", () => {
    const chart = { origin_deg: [0, 0] as [number, number], sphere_radius_m: null };
    expect(latLonDeg(chart, 0, 110_574.4)[0]).toBeCloseTo(1, 4);
    expect(latLonDeg(chart, 111_319.5, 0)[1]).toBeCloseTo(1, 4);
  });
});

describe("a graticule", () => {
  const camera = new PlaneCamera();
  camera.resize(800, 600);
  camera.mPerPx = 200;

  test("has lines at round angles, also across the date line, where the chart has them", () => {
    camera.center([0, 0, 0]);
    const lines = graticule({ ...TRAFFIC, chart: ROUND }, camera, [800, 600]);
    const labels = lines.map(({ label }) => label);
    expect(labels).toContain("180°00′");
    expect(labels).toContain("179°40′W");
    expect(labels).toContain("52°00′N");
    const parallel = lines.find(({ label }) => label === "52°00′N")!;
    for (const [x, y] of parallel.points_m) expect(latLonDeg(ROUND, x, y)[0]).toBeCloseTo(52, 5);
  });

  test("of a plane has round distances", () => {
    const lines = graticule({ ...TRAFFIC, chart: null }, camera, [800, 600]);
    expect(lines.map(({ label }) => label)).toContain("20 km");
  });

  test("labels have their side and the digits of their step", () => {
    expect([angleLabel(4.5, 1800, true), angleLabel(-0.5, 1800, true)]).toEqual(["4°30′E", "0°30′W"]);
    expect([angleLabel(0, 3600, true), angleLabel(190, 3600, true)]).toEqual(["0°", "170°W"]);
    expect(angleLabel(-33.004166667, 15, false)).toBe("33°00′15″S");
  });
});

test("units are those of the field on earth, and SI elsewhere", () => {
  const [aviation, si] = [unitsOf(TRAFFIC), unitsOf({ ...TRAFFIC, chart: null })];
  expect([23_040, 4_999.7, 1_236].map((feet) => aviation.level(0.3048 * feet))).toEqual(["FL230", "FL050", "1240 ft"]);
  expect([aviation.speed(231.5), si.speed(135.4), si.speed(12.34)]).toEqual(["450 kt", "135 m/s", "12.3 m/s"]);
  expect(si.level(3050.2)).toBe("3050 m");
  expect(levelRange(aviation, null, 3048)).toBe("GND–FL100");
  expect(levelRange(si, 900, null)).toBe("900 m–UNL");
  expect([10, 0.1, -0.1, -10].map(verticalSymbol)).toEqual(["↑", "", "", "↓"]);
  expect([lookahead_s(250, 200_000), lookahead_s(250, 20_000)]).toEqual([60, 5]);
});

describe("data blocks", () => {
  const area = { x: 0, y: 0, width: 800, height: 600 };
  const requests = Array.from({ length: 12 }, (_, i): BlockRequest => {
    return { key: i, x: 200 + 45 * (i % 4), y: 200 + 45 * Math.floor(i / 4), width: 60, height: 26 };
  });
  const place = (last: LastPlaces, list = requests): ReturnType<typeof placeBlocks> =>
    placeBlocks(list, { area, taken: [], vectors: [], symbol_px: 6 }, 13, last);

  test("cover neither each other nor any aircraft", () => {
    const placed = place(new Map());
    expect(placed.length).toBe(12);
    placed.forEach(({ rect }, i) => {
      for (const other of placed.slice(i + 1)) expect(isDisjoint(rect, other.rect)).toBe(true);
      for (const { x, y } of requests) {
        const symbol = { x: x - 6, y: y - 6, width: 12, height: 12 };
        expect(isDisjoint(rect, symbol)).toBe(true);
      }
    });
  });

  test("stay where they are while nothing forces them away", () => {
    const last: LastPlaces = new Map();
    const offsets = (): [number, number][] =>
      place(last).map(({ rect, request }) => [rect.x - request.x, rect.y - request.y]);
    const before = offsets();
    for (const request of requests) request.x += 1.5;
    expect(offsets()).toEqual(before);
  });

  test("without a place are left out, the first ones are not", () => {
    const crowd = Array.from({ length: 200 }, (_, i): BlockRequest => ({ ...requests[0]!, key: i }));
    const placed = place(new Map(), crowd);
    expect(placed.length).toBeLessThan(100);
    expect(placed[0]!.request.key).toBe(0);
  });

  test("a line crosses what it passes through and not what it touches", () => {
    const rect = { x: 10, y: 10, width: 20, height: 10 };
    expect(crosses([[0, 0], [40, 30]], rect)).toBe(true); // prettier-ignore
    expect(crosses([[0, 10], [40, 10]], rect)).toBe(false); // prettier-ignore
    expect(crosses([[0, 0], [5, 4]], rect)).toBe(false); // prettier-ignore
  });
});

test("a ring inside of another is a hole, and one inside of the hole an area of its own", () => {
  const square = (half: number): [number, number][] => [
    [-half, -half],
    [half, -half],
    [half, half],
    [-half, half],
    [-half, -half],
  ];
  const [large, hole, island] = [square(9), square(5), square(2)];
  const polygons = polygonsOf([large, hole, island]);
  expect(polygons.map(({ outer, holes }) => [outer, holes.length])).toEqual([
    [large, 1],
    [island, 0],
  ]);
});
