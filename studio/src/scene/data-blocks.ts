/** Places of data blocks beside aircraft, where they cover nothing; as in `draw`'s `plan/data_blocks.rs`. */

export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface BlockRequest {
  key: number;
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface PlacedBlock {
  request: BlockRequest;
  rect: Rect;
}

export type Point = readonly [number, number];
type Segment = readonly [Point, Point];

/** What blocks must not cover, and where they may be. */
export interface Obstacles {
  area: Rect;
  /** Rectangles that no block covers. */
  taken: Rect[];
  /** Velocity vectors, which blocks cover only if there is no other place. */
  vectors: Segment[];
  /** Half the size of the symbol of an aircraft. */
  symbol_px: number;
}

/** Distances from the aircraft that are tried, in lines of text. */
const DISTANCES_LINES = [1.3, 2.2, 3.4, 5, 7];
const DIRECTIONS = 12;
/** Radius within which other aircraft push a block away, in lines of text. */
const CROWD_LINES = 9;
const DIRECTION_COST = 2.5;
const VECTOR_COST = 4;
/** What a change of place costs: blocks that jump from frame to frame cannot be read. */
const MOVE_COST = 3;

/** Offsets of blocks at the last placement, by their keys: direction and distance. */
export type LastPlaces = Map<number, readonly [number, number]>;

/**
 * Places blocks, the first ones first; those without a place are left out. `last` holds their places of the frame before,
 * and afterwards those of this one.
 */
export function placeBlocks(
  requests: readonly BlockRequest[],
  obstacles: Obstacles,
  line_px: number,
  last: LastPlaces,
): PlacedBlock[] {
  const size = 2 * obstacles.symbol_px;
  const symbols = requests.map(({ x, y }) => ({
    x: x - obstacles.symbol_px,
    y: y - obstacles.symbol_px,
    width: size,
    height: size,
  }));
  const taken = [...obstacles.taken, ...symbols];
  const leaders: Segment[] = [];
  const placed: PlacedBlock[] = [];
  const places: [number, readonly [number, number]][] = [];
  for (const request of requests) {
    const free = freeDirection(request, requests, CROWD_LINES * line_px);
    const before = last.get(request.key);
    let best: { cost: number; rect: Rect; place: readonly [number, number] } | null = null;
    for (const [direction, lines] of candidates(free, before)) {
      const off = Math.abs(wrapRad(direction - free));
      const moved = before && (Math.abs(wrapRad(direction - before[0])) > 0.3 || lines !== before[1]);
      let cost = lines + (DIRECTION_COST * off) / Math.PI + (moved ? MOVE_COST : 0);
      if (best && best.cost <= cost) continue;
      const rect = blockRect(request, direction, lines * line_px);
      if (!isFree(request, rect, obstacles.area, taken, leaders)) continue;
      cost += VECTOR_COST * obstacles.vectors.filter((vector) => crosses(vector, rect)).length;
      if (!best || cost < best.cost) best = { cost, rect, place: [direction, lines] };
    }
    if (!best) continue;
    taken.push(best.rect);
    leaders.push([[request.x, request.y], nearestPoint(best.rect, request.x, request.y)]);
    placed.push({ request, rect: best.rect });
    places.push([request.key, best.place]);
  }
  last.clear();
  for (const [key, place] of places) last.set(key, place);
  return placed;
}

function* candidates(
  free: number,
  before: readonly [number, number] | undefined,
): Generator<readonly [number, number]> {
  if (before) yield before;
  for (const lines of DISTANCES_LINES)
    for (let k = 0; k < DIRECTIONS; k++) yield [free + (k * 2 * Math.PI) / DIRECTIONS, lines];
}

function wrapRad(angle: number): number {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** The direction away from other aircraft near by; up and to the right where there are none. */
function freeDirection(own: BlockRequest, all: readonly BlockRequest[], range_px: number): number {
  let [x, y] = [0, 0];
  for (const other of all) {
    const [dx, dy] = [own.x - other.x, own.y - other.y];
    const distance = Math.hypot(dx, dy);
    if (distance === 0 || distance >= range_px) continue;
    const weight = (1 - distance / range_px) / distance;
    x += weight * dx;
    y += weight * dy;
  }
  // Few directions, so that a block does not turn with every step of its neighbors.
  const step = (2 * Math.PI) / DIRECTIONS;
  return x === 0 && y === 0 ? -Math.PI / 4 : Math.round(Math.atan2(y, x) / step) * step;
}

/** The rectangle of a block whose nearest point lies in a direction. */
function blockRect({ x, y, width, height }: BlockRequest, direction: number, distance_px: number): Rect {
  const [ux, uy] = [Math.cos(direction), Math.sin(direction)];
  return {
    x: x + distance_px * ux - 0.5 * width * (1 - ux),
    y: y + distance_px * uy - 0.5 * height * (1 - uy),
    width,
    height,
  };
}

function isFree(
  own: BlockRequest,
  rect: Rect,
  area: Rect,
  taken: readonly Rect[],
  leaders: readonly Segment[],
): boolean {
  if (rect.x < area.x || rect.y < area.y) return false;
  if (rect.x + rect.width > area.x + area.width || rect.y + rect.height > area.y + area.height) return false;
  const leader: Segment = [[own.x, own.y], nearestPoint(rect, own.x, own.y)];
  for (const other of taken) {
    if (!isDisjoint(other, rect)) return false;
    if (!contains(other, own.x, own.y) && crosses(leader, other)) return false;
  }
  return !leaders.some((line) => crosses(line, rect));
}

export function nearestPoint(rect: Rect, x: number, y: number): Point {
  return [Math.min(rect.x + rect.width, Math.max(rect.x, x)), Math.min(rect.y + rect.height, Math.max(rect.y, y))];
}

export function isDisjoint(a: Rect, b: Rect): boolean {
  return a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y;
}

function contains(rect: Rect, x: number, y: number): boolean {
  return x >= rect.x && x <= rect.x + rect.width && y >= rect.y && y <= rect.y + rect.height;
}

/** Returns whether a segment has a point inside of a rectangle: it is clipped at each pair of edges in turn. */
export function crosses([from, to]: Segment, rect: Rect): boolean {
  let [enter, leave] = [0, 1];
  const sides = [
    [from[0], to[0] - from[0], rect.x, rect.x + rect.width],
    [from[1], to[1] - from[1], rect.y, rect.y + rect.height],
  ] as const;
  for (const [start, step, low, high] of sides) {
    if (step === 0) {
      if (start <= low || start >= high) return false;
      continue;
    }
    const [one, other] = [(low - start) / step, (high - start) / step];
    enter = Math.max(enter, Math.min(one, other));
    leave = Math.min(leave, Math.max(one, other));
  }
  return enter < leave;
}
