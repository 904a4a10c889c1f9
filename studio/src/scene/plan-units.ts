/** The units of traffic: those of aviation on earth, else SI; the same as `crates/draw/src/picture/plan/units.rs`. */

import { number } from "../format";
import type { Traffic } from "../protocol";

const NAUTICAL_MILE_M = 1852;
const FOOT_M = 0.3048;
const KNOT_M_S = NAUTICAL_MILE_M / 3600;
/** Altitude in feet from which levels are flight levels. */
const TRANSITION_FT = 5000;
const MIN_KM_EXTENT_M = 5000;
/** Least vertical speed of a climb or a descent: that of 100 ft/min. */
const MIN_CLIMB_M_S = (100 * FOOT_M) / 60;

export interface PlanUnits {
  readonly isAviation: boolean;
  /** The unit of distances in something of this extent, and its length in meters. */
  distance(extent_m: number): [unit: string, unit_m: number];
  /** The step of altitudes at an axis in which they are whole, in meters. */
  readonly altitudeUnit_m: number;
  level(altitude_m: number): string;
  speed(speed_m_s: number): string;
}

const AVIATION: PlanUnits = {
  isAviation: true,
  distance: () => ["NM", NAUTICAL_MILE_M],
  altitudeUnit_m: 100 * FOOT_M,
  level(altitude_m) {
    const feet = altitude_m / FOOT_M;
    // Rounded first: 4999.7 ft is told as FL050.
    const hundreds = Math.round(feet / 100);
    if (hundreds >= TRANSITION_FT / 100) return `FL${String(hundreds).padStart(3, "0")}`;
    return `${number(Math.round(feet / 10) * 10)} ft`;
  },
  speed: (speed_m_s) => `${number(Math.round(speed_m_s / KNOT_M_S))} kt`,
};

const SI: PlanUnits = {
  isAviation: false,
  distance: (extent_m) => (extent_m < MIN_KM_EXTENT_M ? ["m", 1] : ["km", 1000]),
  altitudeUnit_m: 1,
  level: (altitude_m) => `${number(Math.round(altitude_m))} m`,
  speed: (speed_m_s) => `${number(speed_m_s >= 20 ? Math.round(speed_m_s) : Math.round(speed_m_s * 10) / 10)} m/s`,
};

export function unitsOf(traffic: Traffic): PlanUnits {
  return traffic.chart ? AVIATION : SI;
}

/** The limits of an area in words. */
export function levelRange(units: PlanUnits, low_m: number | null, high_m: number | null): string {
  return `${low_m === null ? "GND" : units.level(low_m)}–${high_m === null ? "UNL" : units.level(high_m)}`;
}

/** The symbol of a vertical speed; none in level flight. */
export function verticalSymbol(climb_m_s: number): string {
  if (climb_m_s >= MIN_CLIMB_M_S) return "↑";
  return climb_m_s <= -MIN_CLIMB_M_S ? "↓" : "";
}

/** Times that velocity vectors may reach ahead. */
const LOOKAHEADS_S = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800];
/** Largest length of a velocity vector, as a part of the longer side of what is shown. */
const MAX_VECTOR_PART = 0.09;

/** The longest round time for which velocity vectors stay short. */
export function lookahead_s(fastest_m_s: number, extent_m: number): number {
  const max_s = (MAX_VECTOR_PART * extent_m) / Math.max(1e-9, fastest_m_s);
  return LOOKAHEADS_S.findLast((time_s) => time_s <= max_s) ?? LOOKAHEADS_S[0]!;
}

/** A time in words. */
export function timeAhead(time_s: number): string {
  return time_s >= 120 ? `${time_s / 60} min` : `${time_s} s`;
}
