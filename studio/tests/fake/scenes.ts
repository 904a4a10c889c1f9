/** Three made-up worlds: closed formulas of the cycle, so that seeks are reproducible. */

import type { BodyTable, RunEvent, Inspection, Appearance, Scan, Scene, Shape, BodyId } from "../../src/protocol";
import type { Columns } from "./encode";

export interface FakeWorld {
  scene: Scene;
  cyclesPlanned: number;
  table: Omit<BodyTable, "session" | "id">;
  columns(cycle: number): Pick<Columns, "positions_m" | "orientations" | "lines" | "conditions" | "velocities_m_s">;
  events(from: number, until: number): RunEvent[];
  inspect(who: BodyId, cycle: number): Inspection;
  scans(who: BodyId, cycle: number): Scan[];
}

const COLORS: [number, number, number][] = [
  [0x00, 0x72, 0xb2],
  [0xd5, 0x5e, 0x00],
  [0x00, 0x9e, 0x73],
  [0xcc, 0x79, 0xa7],
  [0xe6, 0x9f, 0x00],
  [0x56, 0xb4, 0xe9],
];

function looks(
  color: [number, number, number],
  opacity: number,
  layer: number,
): [Appearance, Appearance, Appearance, Appearance, Appearance] {
  const plain: Appearance = { color, opacity, layer };
  const alert: Appearance = { color: [0xd0, 0x10, 0x10], opacity: Math.max(opacity, 0.4), layer };
  return [plain, plain, { ...plain, opacity: 0.25 }, alert, alert];
}

const ALL_COLORS = COLORS.map((color) => looks(color, 1, 5));

/** The border of an area north of the middle of the airspace. */
const FAKE_AREA: Scene["bodies"][number] = {
  id: { kind: "area", number: 0, part: 0 },
  name: "EHR 4",
  at_m: [0, 5000, 3000],
  orientation: [0, 0, 0, 1],
  shape: {
    type: "line",
    points_m: [
      [-2000, 4500, 3000],
      [2000, 4500, 3000],
      [2000, 6500, 3000],
      [-2000, 6500, 3000],
      [-2000, 4500, 3000],
    ],
    thickness_m: 25,
  },
  appearance: { color: [60, 60, 60], opacity: 1, layer: 1 },
};

/** A pseudo-random number from 0 to 1, by two numbers. */
function chance(a: number, b: number): number {
  const x = Math.sin(a * 127.1 + b * 311.7) * 43758.5453;
  return x - Math.floor(x);
}

function every(period: number, from: number, until: number, make: (cycle: number) => RunEvent): RunEvent[] {
  const found: RunEvent[] = [];
  for (let c = Math.ceil(Math.max(1, from) / period) * period; c <= until; c += period) found.push(make(c));
  return found;
}

const CODES = { free: 0, wall: 1, unknown: 2 };

function runsOf(width: number, height: number, code: (x: number, y: number) => number): number[] {
  const runs: number[] = [];
  for (let i = 0; i < width * height; i++) {
    const now = code(i % width, Math.floor(i / width));
    if (runs.length > 0 && runs[runs.length - 2] === now) runs[runs.length - 1]!++;
    else runs.push(now, 1);
  }
  return runs;
}

/** A floor of rooms with robots on circles. */
export function robots(count: number): FakeWorld {
  const side = Math.max(60, Math.ceil(Math.sqrt(count) * 4));
  const box = 0.25;
  const perRow = Math.ceil(Math.sqrt(count));
  const pitch = (side * box) / perRow;
  const wall = (x: number, y: number): number => {
    if (x > side - 4 && y > side - 9) return CODES.unknown;
    if (x === 0 || y === 0 || x === side - 1 || y === side - 1) return CODES.wall;
    return (x % 30 === 0 && y % 15 > 5) || (y % 30 === 0 && x % 15 > 5) ? CODES.wall : CODES.free;
  };
  const who = (number: number): BodyId => ({ kind: "robot", number, part: null });
  const at = (i: number, cycle: number): [number, number, number] => {
    const angle = cycle * 0.05 * (0.5 + chance(i, 1)) + 6.28 * chance(i, 2);
    const r = 0.32 * pitch;
    const [x, y] = [((i % perRow) + 0.5) * pitch, (Math.floor(i / perRow) + 0.5) * pitch];
    return [x + r * Math.cos(angle), y + r * Math.sin(angle), angle + Math.PI / 2];
  };
  const touches = (i: number, cycle: number): boolean => chance(i, Math.floor(cycle / 20)) > 0.985;
  const shapes: Shape[] = [
    { type: "cylinder", radius_m: 0.25, height_m: 0.5 },
    { type: "cuboid", size_m: [0.7, 0.5, 0.5] },
  ];
  return {
    cyclesPlanned: 10_000,
    scene: {
      name: "Made-up hall",
      world: "robots",
      agent: "robot",
      dimensions: 2,
      cycle_s: 0.1,
      is_recording: false,
      traffic: null,
      floor: { width: side, height: side, box_m: box, origin_m: [0, 0], yaw_rad: 0, runs: runsOf(side, side, wall) },
      bodies: [
        {
          id: { kind: "obstacle", number: 0, part: null },
          name: null,
          at_m: [2, 2, 0],
          orientation: [0, 0, 0.3, 0.95],
          shape: { type: "cuboid", size_m: [1.2, 0.4, 1] },
          appearance: { color: [60, 60, 60], opacity: 1, layer: 1 },
        },
      ],
      groups: [
        { name: "couriers", kind: "robot", first: 0, count: Math.ceil(count / 3) },
        { name: "guards", kind: "robot", first: Math.ceil(count / 3), count: count - Math.ceil(count / 3) },
      ],
      names: [
        { kind: "robot", number: 0, name: "courier Anna" },
        { kind: "robot", number: 1, name: "courier Bert" },
      ],
    },
    table: {
      kinds: ["robot"],
      kind: Array.from({ length: count }, () => 0),
      number: Array.from({ length: count }, (_, i) => i),
      part: Array.from({ length: count }, () => -1),
      shapes,
      shape: Array.from({ length: count }, (_, i) => (i % 5 === 0 ? 1 : 0)),
      appearances: ALL_COLORS,
      appearance: Array.from({ length: count }, (_, i) => i % 6),
      names: [
        [0, "courier Anna"],
        [1, "courier Bert"],
      ],
      is_agent: Array.from({ length: count }, () => true),
    },
    columns(cycle) {
      const positions_m: number[] = [];
      const orientations: number[] = [];
      const conditions: number[] = [];
      for (let i = 0; i < count; i++) {
        const [x, y, heading] = at(i, cycle);
        positions_m.push(x, y);
        orientations.push(heading);
        conditions.push(touches(i, cycle) ? 3 : 0);
      }
      return { positions_m, orientations, lines: [], conditions };
    },
    events(from, until) {
      const bump = every(40, from, until, (cycle) => {
        const i = Math.floor(chance(cycle, 3) * Math.min(count, 50));
        const [x, y] = at(i, cycle);
        return {
          cycle,
          level: "warning",
          kind: "contact",
          body: who(i),
          other: who((i + 1) % count),
          at_m: [x, y, 0],
          value: 0.02,
          unit: "m",
          text: `robot ${i} touched its neighbor`,
        };
      });
      const trip = every(110, from, until, (cycle) => ({
        cycle,
        level: "info",
        kind: "trip",
        body: who(cycle % Math.min(count, 9)),
        other: null,
        at_m: null,
        value: 31.5,
        unit: "s",
        text: "a trip from the southern corridor to the northern one has ended",
      }));
      return [...bump, ...trip].sort((a, b) => a.cycle - b.cycle);
    },
    inspect(body, cycle) {
      const [x, y] = at(body.number, cycle);
      return {
        body: body,
        cycle,
        title: `robot ${body.number} of the southern couriers`,
        sections: [
          {
            title: "Perceives",
            facts: [
              { label: "place", value: { place: [x, y, 0] } },
              { label: "nearest wall", value: { number: { value: 1.25, unit: "m" } } },
              { label: "in contact", value: { flag: touches(body.number, cycle) } },
            ],
            table: {
              columns: ["beam", "as it is", "as reported", "class"],
              rows: [0, 1, 2, 3].map((i) => [
                { text: `${i * 90}°` },
                { number: { value: 1 + chance(i, cycle), unit: "m" } },
                i === 2 ? "none" : { number: { value: 1.1 + chance(i, cycle), unit: "m" } },
                { text: i === 2 ? "nothing" : "near" },
              ]),
            },
          },
          {
            title: "Decides",
            facts: [
              { label: "action", value: { text: "forward" } },
              { label: "drawn with", value: { share: 0.815 } },
              { label: "group with", value: { body: who((body.number + 1) % count) } },
              { label: "message", value: "none" },
            ],
            table: null,
          },
        ],
        marks: [
          {
            role: "claim",
            label: "boxes claimed",
            weight: 1,
            shape: {
              type: "area",
              corners_m: [
                [x - 0.5, y - 0.5, 0],
                [x + 0.75, y - 0.5, 0],
                [x + 0.75, y + 0.5, 0],
                [x - 0.5, y + 0.5, 0],
              ],
            },
          },
          {
            role: "group",
            label: "conflict group",
            weight: 0.6,
            shape: { type: "circle", at_m: [x, y, 0], radius_m: 1.6 },
          },
          {
            role: "target",
            label: "way-point",
            weight: 1,
            shape: {
              type: "line",
              points_m: [
                [x, y, 0],
                [x + 3, y + 2, 0],
              ],
            },
          },
        ],
      };
    },
    scans(body, cycle) {
      const [x, y, heading] = at(body.number, cycle);
      const beams = Array.from({ length: 8 }, (_, i) => i);
      return [
        {
          body: body,
          sensor: "sonar",
          at_m: [x, y, 0],
          orientation: [0, 0, Math.sin(heading / 2), Math.cos(heading / 2)],
          bearings_rad: beams.map((i) => (i * Math.PI) / 4),
          ranges_m: beams.map((i) => (i === 3 ? null : 1 + 2 * chance(i, cycle))),
          true_m: beams.map((i) => (i === 3 ? null : 1.1 + 2 * chance(i, cycle))),
          range_m: 4,
        },
      ];
    },
  };
}

/** A chain that winds through balls. */
export function chain(): FakeWorld {
  const n = 60;
  const at = (i: number, cycle: number): [number, number, number] => {
    const s = 0.25 * i + 0.02 * cycle;
    return [4 * Math.cos(0.4 * s), 4 * Math.sin(0.4 * s), 1.5 * Math.sin(0.7 * s)];
  };
  const who = (part: number): BodyId => ({ kind: "connector", number: 0, part });
  const ball = (i: number): Scene["bodies"][number] => ({
    id: { kind: "obstacle", number: i, part: null },
    name: null,
    at_m: [10 * (chance(i, 1) - 0.5), 10 * (chance(i, 2) - 0.5), 5 * (chance(i, 3) - 0.5)],
    orientation: [0, 0, 0, 1],
    shape:
      i % 4 === 0 ? { type: "cuboid", size_m: [0.8, 0.6, 1] } : { type: "sphere", radius_m: 0.2 + 0.4 * chance(i, 4) },
    appearance: { color: [60, 60, 60], opacity: 0.22, layer: 1 },
  });
  const fill = <T>(value: T): T[] => Array.from({ length: n }, () => value);
  return {
    cyclesPlanned: 4000,
    scene: {
      name: "Made-up snake",
      world: "chain",
      agent: "connector",
      dimensions: 3,
      cycle_s: 0.02,
      is_recording: false,
      groups: [],
      names: [],
      floor: null,
      traffic: null,
      bodies: Array.from({ length: 80 }, (_, i) => ball(i)),
    },
    table: {
      kinds: ["connector", "rods"],
      kind: [...fill(0), 1],
      number: [...fill(0), 0],
      part: [...fill(0).map((_, i) => i), -1],
      shapes: [
        { type: "sphere", radius_m: 0.09 },
        { type: "line", points_m: [], thickness_m: 0.06 },
      ],
      shape: [...fill(0), 1],
      appearances: ALL_COLORS,
      appearance: [...fill(1), 0],
      names: [],
      is_agent: [...fill(true), false],
    },
    columns(cycle) {
      const points = Array.from({ length: n }, (_, i) => at(i, cycle)).flat();
      const conditions = Array.from({ length: n + 1 }, (_, i) =>
        i < n && cycle % 200 > 150 && i === 20 ? 3 : i === 0 ? 1 : 0,
      );
      return {
        positions_m: [...points, 0, 0, 0],
        orientations: Array.from({ length: 4 * (n + 1) }, (_, i) => (i % 4 === 3 ? 1 : 0)),
        lines: [points],
        conditions,
      };
    },
    events: (from, until) =>
      every(50, from, until, (cycle) => ({
        cycle,
        level: "info",
        kind: cycle % 100 === 0 ? "veto" : "layer",
        body: who((cycle / 50) % n),
        other: null,
        at_m: at((cycle / 50) % n, cycle),
        value: 0.1,
        unit: "m",
        text: "could have gone 0.1 m before obstacle 3",
      })),
    inspect(body, cycle) {
      const p = at(body.part ?? 0, cycle);
      return {
        body: body,
        cycle,
        title: `connector ${body.part} of the snake`,
        sections: [
          {
            title: "Wish",
            facts: [
              { label: "turn", value: { number: { value: -12.5, unit: "°" } } },
              { label: "place", value: { place: p } },
              { label: "vetoed by", value: { body: who(7) } },
            ],
            table: null,
          },
        ],
        marks: [
          { role: "wish", label: "wished", weight: 1, shape: { type: "line", points_m: [p, [p[0], p[1], p[2] + 1]] } },
          { role: "refused", label: "veto", weight: 1, shape: { type: "point", at_m: [p[0], p[1], p[2] + 1] } },
        ],
      };
    },
    scans: () => [],
  };
}

/** Airplanes that meet in the middle, with zones. */
export function airplanes(): FakeWorld {
  const n = 8;
  const at = (i: number, cycle: number): [number, number, number] => {
    const angle = (2 * Math.PI * i) / n;
    const way = -6500 + 175 * (cycle % 75);
    const bend = 900 * Math.exp(-((way / 2500) ** 2));
    return [way * Math.cos(angle) - bend * Math.sin(angle), way * Math.sin(angle) + bend * Math.cos(angle), angle];
  };
  const two = <T>(airplane: (i: number) => T, zone: (i: number) => T): T[] => [
    ...Array.from({ length: n }, (_, i) => airplane(i)),
    ...Array.from({ length: n }, (_, i) => zone(i)),
  ];
  const who = (number: number): BodyId => ({ kind: "airplane", number, part: null });
  return {
    cyclesPlanned: 75,
    scene: {
      name: "Made-up super-conflict",
      world: "airspace",
      agent: "airplane",
      dimensions: 2,
      cycle_s: 5,
      is_recording: false,
      groups: [],
      names: Array.from({ length: n }, (_, i) => ({ kind: "airplane", number: i, name: `ONE${11 + i}` })),
      floor: null,
      traffic: {
        chart: { origin_deg: [52, 4.5], sphere_radius_m: null },
        level_m: 3000,
        areas: [{ kind: "area", number: 0, name: "EHR 4", is_fence: false, low_m: null, high_m: 3048 }],
        routes: [],
      },
      bodies: Array.from({ length: n }, (_, i): Scene["bodies"][number] => {
        const [x, y] = at((i + n / 2) % n, 0);
        return {
          id: { kind: "goal", number: i, part: null },
          name: null,
          at_m: [x, y, 0],
          orientation: [0, 0, 0, 1],
          shape: { type: "cylinder", radius_m: 100, height_m: 1 },
          appearance: { color: COLORS[i % 6]!, opacity: 0.45, layer: 2 },
        };
      }).concat(FAKE_AREA),
    },
    table: {
      kinds: ["airplane", "zone"],
      kind: two(
        () => 0,
        () => 1,
      ),
      number: two(
        (i) => i,
        (i) => i,
      ),
      part: two(
        () => -1,
        () => -1,
      ),
      shapes: [
        { type: "dart", length_m: 300, width_m: 200 },
        { type: "cylinder", radius_m: 250, height_m: 300 },
      ],
      shape: two(
        () => 0,
        () => 1,
      ),
      appearances: [...ALL_COLORS, ...COLORS.map((color) => looks(color, 0.15, 3))],
      appearance: two(
        (i) => i % 6,
        (i) => 6 + (i % 6),
      ),
      names: Array.from({ length: n }, (_, i) => [i, `ONE${11 + i}`]),
      is_agent: two(
        () => true,
        () => false,
      ),
    },
    columns(cycle) {
      const all = Array.from({ length: 2 * n }, (_, i) => at(i % n, cycle));
      return {
        positions_m: all.flatMap(([x, y]) => [x, y]),
        orientations: all.map(([, , h]) => h),
        lines: [],
        // 175 m in 5 s.
        velocities_m_s: all.flatMap(([, , h]) => [35 * Math.cos(h), 35 * Math.sin(h), 0]),
        conditions: all.map((_, i) => (i === 8 && cycle > 30 && cycle < 34 ? 3 : 0)),
      };
    },
    events: (from, until) =>
      every(15, from, until, (cycle) => ({
        cycle,
        level: "info",
        kind: cycle === 30 ? "separation" : "agreement",
        body: who((cycle / 15) % n),
        other: who((cycle / 15 + 1) % n),
        at_m: null,
        value: 480,
        unit: "m",
        text: cycle === 30 ? "separation lost: 480 m of 500 m" : "agreed after 4 rounds",
      })),
    inspect(body, cycle) {
      const way = (shift: number): [number, number, number][] =>
        Array.from({ length: 18 }, (_, k) => {
          const [x, y] = at(body.number, cycle + k * 0.9);
          return [x + shift * k, y - shift * k, 0];
        });
      return {
        body: body,
        cycle,
        title: `ONE${11 + body.number}`,
        sections: [
          {
            title: "Options",
            facts: [{ label: "group of", value: { number: { value: 4, unit: "airplanes" } } }],
            table: {
              columns: ["turn", "probability", "expectation"],
              rows: [-4, 0, 4].map((t, i) => [
                { number: { value: t, unit: "°/s" } },
                { share: [0.08, 0.72, 0.2][i]! },
                { number: { value: 12345.678 * (i + 1), unit: "" } },
              ]),
            },
          },
        ],
        marks: [-40, 0, 40].map((shift, i) => ({
          role: i === 1 ? "chosen" : "predicted",
          label: "way",
          weight: [0.08, 0.72, 0.2][i]!,
          shape: { type: "line", points_m: way(shift) },
        })),
      };
    },
    scans: () => [],
  };
}
