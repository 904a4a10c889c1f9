/** Areas of traffic: the borders that belong to each, filled and hatched in a plan. */

import { BufferGeometry, DoubleSide, Float32BufferAttribute, Mesh, ShapeUtils, Vector2, type IUniform } from "three";
import type { Frame } from "../decode";
import type { Point3, Scene, TrafficArea } from "../protocol";
import type { Bodies } from "../state/bodies";
import { material } from "./material";
import type { Palette, Rgb } from "./palette";

/** Colors of areas on light and dark ground: none of those of aircraft. */
const AREA_RGB: Rgb = [0x6a, 0x5a, 0xcd];
const DARK_AREA_RGB: Rgb = [0xa8, 0x9c, 0xf4];

type Ring = readonly [number, number][];

export interface DrawnArea {
  area: TrafficArea;
  rings_m: Ring[];
  low_m: [number, number];
  high_m: [number, number];
}

export function areaColor(palette: Palette): Rgb {
  return palette.isDark ? DARK_AREA_RGB : AREA_RGB;
}

interface Border {
  key: string;
  points_m: Point3[];
}

/** The areas that never change. */
export function staticAreas(scene: Scene): DrawnArea[] {
  const borders = scene.bodies.flatMap(({ id, shape }): Border[] => {
    if (shape.type !== "line") return [];
    return [{ key: keyOf(id.kind, id.number), points_m: shape.points_m }];
  });
  return areasOf(scene, borders);
}

/** The areas of a frame, which come, go or move. */
export function movingAreas(scene: Scene, bodies: Bodies, frame: Frame): DrawnArea[] {
  const { table } = bodies;
  const d = frame.dimensions;
  const borders = [...bodies.lines].map((index, line): Border => {
    const points_m: Point3[] = [];
    for (let p = frame.lineStarts[line]!; p < frame.lineStarts[line + 1]!; p++) {
      const z = d === 3 ? frame.points_m[3 * p + 2]! : 0;
      points_m.push([frame.points_m[d * p]!, frame.points_m[d * p + 1]!, z]);
    }
    const key = keyOf(table.kinds[table.kind[index]!]!, table.number[index]!);
    return { key, points_m };
  });
  return areasOf(scene, borders);
}

function keyOf(kind: string, number: number): string {
  return `${kind}/${number}`;
}

/** Borders on the level of the first one make an area: others are the same, seen from above. */
function areasOf(scene: Scene, borders: readonly Border[]): DrawnArea[] {
  return (scene.traffic?.areas ?? []).flatMap((area): DrawnArea[] => {
    const own = borders.filter(({ key, points_m }) => key === keyOf(area.kind, area.number) && points_m.length > 2);
    if (own.length === 0) return [];
    const level = own[0]!.points_m[0]![2];
    const rings_m = own
      .filter(({ points_m }) => points_m[0]![2] === level)
      .map(({ points_m }) => points_m.map(([x, y]): [number, number] => [x, y]));
    return [{ area, rings_m, ...boundsOf(rings_m) }];
  });
}

function boundsOf(rings_m: readonly Ring[]): Pick<DrawnArea, "low_m" | "high_m"> {
  const low_m: [number, number] = [Infinity, Infinity];
  const high_m: [number, number] = [-Infinity, -Infinity];
  // A border may have more points than a call may have arguments.
  for (const ring of rings_m)
    for (const at_m of ring)
      for (const axis of [0, 1] as const) {
        low_m[axis] = Math.min(low_m[axis], at_m[axis]);
        high_m[axis] = Math.max(high_m[axis], at_m[axis]);
      }
  return { low_m, high_m };
}

const VERTEX = `
in vec3 position;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

const FRAGMENT = `
uniform vec3 ink;
uniform float ratio;
void main() {
  float hatch = mod((gl_FragCoord.x + gl_FragCoord.y) / ratio, 11.0) < 1.5 ? 0.26 : 0.0;
  color = vec4(ink, 0.09 + hatch);
}`;

/** Fills an area. `ratio` is the number of pixels for each of the page. The caller disposes of the mesh. */
export function fillArea({ rings_m }: DrawnArea, palette: Palette, ratio: IUniform<number>): Mesh {
  const positions: number[] = [];
  const index: number[] = [];
  for (const { outer, holes } of polygonsOf(rings_m)) {
    const first = positions.length / 3;
    // A ring ends where it began; triangulation wants each corner once.
    const rings = [outer, ...holes].map((ring) => ring.slice(0, -1).map(([x, y]) => new Vector2(x, y)));
    for (const { x, y } of rings.flat()) positions.push(x, y, 0);
    const triangles = ShapeUtils.triangulateShape(rings[0]!, rings.slice(1));
    index.push(...triangles.flat().map((corner) => corner + first));
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.setIndex(index);
  const [r, g, b] = areaColor(palette);
  const uniforms = { ink: { value: [r / 255, g / 255, b / 255] }, ratio };
  const look = material({ vertex: VERTEX, fragment: FRAGMENT, uniforms, depth: false, transparent: true });
  look.side = DoubleSide;
  const mesh = new Mesh(geometry, look);
  mesh.renderOrder = 1;
  mesh.frustumCulled = false;
  return mesh;
}

/** Rings inside of an odd number of others are holes, of the one around them. */
export function polygonsOf(rings: readonly Ring[]): { outer: Ring; holes: Ring[] }[] {
  const around = rings.map((ring) => rings.filter((other) => other !== ring && isInside(ring[0]!, other)));
  const polygons = rings.flatMap((outer, i) => (around[i]!.length % 2 === 0 ? [{ outer, holes: [] as Ring[] }] : []));
  rings.forEach((ring, i) => {
    if (around[i]!.length % 2 === 0) return;
    polygons.find(({ outer }) => around[i]!.includes(outer))?.holes.push(ring);
  });
  return polygons;
}

function isInside([x, y]: readonly [number, number], ring: Ring): boolean {
  let inside = false;
  for (let i = 1; i < ring.length; i++) {
    const [[ax, ay], [bx, by]] = [ring[i - 1]!, ring[i]!];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  }
  return inside;
}
