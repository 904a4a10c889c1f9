/** Places of a chart as latitude and longitude; the same as the kernel's `view/earth.rs` and `geodesy.rs`. */

import type { EarthChart } from "../protocol";

/** Equatorial radius and flattening of WGS84. */
const EQUATORIAL_RADIUS_M = 6_378_137;
const FLATTENING = 1 / 298.257223563;
const POLAR_RADIUS_M = EQUATORIAL_RADIUS_M * (1 - FLATTENING);
/** Iterations of the direct solution: each gains three digits, and a pixel needs six. */
const ITERATIONS = 6;
const DEG = Math.PI / 180;

/** Returns an angle in (-180, 180]. */
export function wrapDeg(deg: number): number {
  const turned = (((deg + 180) % 360) + 360) % 360;
  return turned === 0 ? 180 : turned - 180;
}

/** Returns latitude and longitude in degrees of a place in meters east and north of a chart's origin. */
export function latLonDeg(chart: EarthChart, x_m: number, y_m: number): [number, number] {
  const [lat, lon] = chart.origin_deg;
  if (chart.sphere_radius_m !== null) {
    const east = chart.sphere_radius_m * Math.max(1e-9, Math.cos(lat * DEG));
    return [lat + y_m / chart.sphere_radius_m / DEG, wrapDeg(lon + x_m / east / DEG)];
  }
  const length_m = Math.hypot(x_m, y_m);
  return length_m === 0 ? [lat, lon] : destinationDeg(lat, lon, [x_m / length_m, y_m / length_m], length_m);
}

/** Vincenty's direct solution: the place at the end of a shortest path on the ellipsoid. */
function destinationDeg(
  lat_deg: number,
  lon_deg: number,
  [sinAlpha1, cosAlpha1]: [number, number],
  length_m: number,
): [number, number] {
  const u1 = Math.atan2((1 - FLATTENING) * Math.sin(lat_deg * DEG), Math.cos(lat_deg * DEG));
  const [sinU1, cosU1] = [Math.sin(u1), Math.cos(u1)];
  const sigma1 = Math.atan2(sinU1, cosU1 * cosAlpha1);
  const sinAlpha = cosU1 * sinAlpha1;
  const cosSqAlpha = 1 - sinAlpha * sinAlpha;
  const ratio = (EQUATORIAL_RADIUS_M / POLAR_RADIUS_M) ** 2 - 1;
  const uSq = cosSqAlpha * ratio;
  const a = 1 + (uSq / 16384) * (4096 + uSq * (-768 + uSq * (320 - 175 * uSq)));
  const b = (uSq / 1024) * (256 + uSq * (-128 + uSq * (74 - 47 * uSq)));
  const first = length_m / (POLAR_RADIUS_M * a);
  let sigma = first;
  for (let i = 0; i < ITERATIONS; i++) {
    const [sin, cos, cos2m] = [Math.sin(sigma), Math.cos(sigma), Math.cos(2 * sigma1 + sigma)];
    const square = 2 * cos2m * cos2m - 1;
    const cubic = (b / 6) * cos2m * (4 * sin * sin - 3) * (4 * cos2m * cos2m - 3);
    sigma = first + b * sin * (cos2m + (b / 4) * (cos * square - cubic));
  }
  const [sin, cos, cos2m] = [Math.sin(sigma), Math.cos(sigma), Math.cos(2 * sigma1 + sigma)];
  const backward = sinU1 * sin - cosU1 * cos * cosAlpha1;
  const lat = Math.atan2(sinU1 * cos + cosU1 * sin * cosAlpha1, (1 - FLATTENING) * Math.hypot(sinAlpha, backward));
  const lambda = Math.atan2(sin * sinAlpha1, cosU1 * cos - sinU1 * sin * cosAlpha1);
  const c = (FLATTENING / 16) * cosSqAlpha * (4 + FLATTENING * (4 - 3 * cosSqAlpha));
  const bracket = cos2m + c * cos * (2 * cos2m * cos2m - 1);
  const difference = lambda - (1 - c) * FLATTENING * sinAlpha * (sigma + c * sin * bracket);
  return [lat / DEG, wrapDeg(lon_deg + difference / DEG)];
}
