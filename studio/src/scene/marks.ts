/** Drawings over the scene for the selected body: its inspection marks and sensor beams. */

import { BufferGeometry, DoubleSide, Float32BufferAttribute, Mesh, ShapeUtils, Vector2 } from "three";
import type { Mark, Point3, MarkRole, Scan } from "../protocol";
import { material } from "./material";
import { ROLES, visibleColor, packColor, type Palette, type Rgb } from "./palette";
import type { Strokes } from "./strokes";

/** Returns the opacity of a mark of this weight. */
function alphaOf(weight: number): number {
  return 0.25 + 0.7 * Math.min(1, Math.max(0, weight));
}

export function circle(at: Point3, radius_m: number): Point3[] {
  const n = 64;
  return Array.from({ length: n + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / n;
    return [at[0] + radius_m * Math.cos(angle), at[1] + radius_m * Math.sin(angle), at[2]];
  });
}

/** Draws the outlines of marks. Returns the roles that occur, for a legend. */
export function drawMarks(marks: readonly Mark[], strokes: Strokes, palette: Palette): Set<MarkRole> {
  const roles = new Set<MarkRole>();
  for (const { role, weight, shape } of marks) {
    roles.add(role);
    const { color, dashed } = ROLES[role];
    const tint = packColor(visibleColor(color, palette), alphaOf(weight));
    const width_px = 1 + 2 * Math.min(1, Math.max(0, weight));
    if (shape.type === "line") strokes.path(shape.points_m, width_px, tint, dashed);
    else if (shape.type === "area") strokes.path([...shape.corners_m, shape.corners_m[0]!], width_px, tint, dashed);
    else if (shape.type === "circle") strokes.path(circle(shape.at_m, shape.radius_m), width_px, tint, dashed);
    else strokes.dot(shape.at_m, 9, tint);
  }
  return roles;
}

/** Fills the areas of marks. The caller disposes of the meshes. */
export function fillAreas(marks: readonly Mark[], palette: Palette): Mesh[] {
  const meshes: Mesh[] = [];
  for (const { role, weight, shape } of marks) {
    if (shape.type !== "area" || shape.corners_m.length < 3) continue;
    meshes.push(fillPolygon(shape.corners_m, visibleColor(ROLES[role].color, palette), 0.22 * alphaOf(weight)));
  }
  return meshes;
}

const AREA_VERTEX = `
in vec3 position;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

const AREA_FRAGMENT = `
uniform vec4 ink;
void main() { color = ink; }`;

function fillPolygon(corners: Point3[], [r, g, b]: Rgb, opacity: number): Mesh {
  const flat = corners.map(([x, y]) => new Vector2(x, y));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(corners.flat(), 3));
  geometry.setIndex(ShapeUtils.triangulateShape(flat, []).flat());
  const uniforms = { ink: { value: [r / 255, g / 255, b / 255, opacity] } };
  const look = material({ vertex: AREA_VERTEX, fragment: AREA_FRAGMENT, uniforms, depth: false, transparent: true });
  look.side = DoubleSide;
  const mesh = new Mesh(geometry, look);
  mesh.renderOrder = 6;
  mesh.frustumCulled = false;
  return mesh;
}

/** A direction in the plane of a sensor, turned as the sensor is. */
function beamEnd(scan: Scan, bearing: number, range_m: number): Point3 {
  const [qx, qy, qz, qw] = scan.orientation;
  const v: Point3 = [Math.cos(bearing), Math.sin(bearing), 0];
  const t: Point3 = [2 * (qy * v[2] - qz * v[1]), 2 * (qz * v[0] - qx * v[2]), 2 * (qx * v[1] - qy * v[0])];
  return [
    scan.at_m[0] + range_m * (v[0] + qw * t[0] + qy * t[2] - qz * t[1]),
    scan.at_m[1] + range_m * (v[1] + qw * t[1] + qz * t[0] - qx * t[2]),
    scan.at_m[2] + range_m * (v[2] + qw * t[2] + qx * t[1] - qy * t[0]),
  ];
}

/** Draws beams: as it is solid, as reported dashed with a dot at the end. Returns the roles that occur. */
export function drawScans(scans: readonly Scan[], strokes: Strokes, palette: Palette): Set<MarkRole> {
  const roles = new Set<MarkRole>();
  const truth = visibleColor(ROLES.true.color, palette);
  const report = visibleColor(ROLES.reported.color, palette);
  for (const scan of scans) {
    scan.bearings_rad.forEach((bearing, i) => {
      const is_m = scan.true_m[i];
      if (is_m !== undefined) {
        roles.add("true");
        strokes.piece(
          scan.at_m,
          beamEnd(scan, bearing, is_m ?? scan.range_m),
          1.5,
          0,
          packColor(truth, is_m === null ? 0.3 : 0.8),
        );
      }
      const reported_m = scan.ranges_m[i];
      roles.add("reported");
      const end = beamEnd(scan, bearing, reported_m ?? scan.range_m);
      strokes.piece(scan.at_m, end, 1.5, 0, packColor(report, reported_m == null ? 0.3 : 0.9), true);
      if (reported_m != null) strokes.dot(end, 6, packColor(report, 1));
    });
  }
  return roles;
}
