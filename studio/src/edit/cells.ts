/** Boxes touched by tools: column and row, from the lower-left corner of the map. */

export type Cell = readonly [column: number, row: number];

/** All boxes of a straight line from one to the other, by Bresenham. */
export function lineCells([c0, r0]: Cell, [c1, r1]: Cell): Cell[] {
  const cells: Cell[] = [];
  const [dc, dr] = [Math.abs(c1 - c0), -Math.abs(r1 - r0)];
  const [sc, sr] = [Math.sign(c1 - c0), Math.sign(r1 - r0)];
  let [c, r, error] = [c0, r0, dc + dr];
  while (true) {
    cells.push([c, r]);
    if (c === c1 && r === r1) return cells;
    const twice = 2 * error;
    if (twice >= dr) {
      error += dr;
      c += sc;
    }
    if (twice <= dc) {
      error += dc;
      r += sr;
    }
  }
}

export interface Rect {
  column: number;
  row: number;
  width: number;
  height: number;
}

export function rectOf([c0, r0]: Cell, [c1, r1]: Cell): Rect {
  return {
    column: Math.min(c0, c1),
    row: Math.min(r0, r1),
    width: Math.abs(c1 - c0) + 1,
    height: Math.abs(r1 - r0) + 1,
  };
}

/** The boxes of a rectangle between two corners: its border, or all of it. */
export function rectangleCells(from: Cell, to: Cell, isFilled: boolean): Cell[] {
  const { column, row, width, height } = rectOf(from, to);
  const cells: Cell[] = [];
  for (let r = row; r < row + height; r++) {
    for (let c = column; c < column + width; c++) {
      const isBorder = r === row || r === row + height - 1 || c === column || c === column + width - 1;
      if (isFilled || isBorder) cells.push([c, r]);
    }
  }
  return cells;
}

/** The boxes of a square brush moved along boxes; each once. */
export function brushCells(cells: readonly Cell[], side: number): Cell[] {
  const found = new Map<string, Cell>();
  const before = Math.floor((side - 1) / 2);
  for (const [c, r] of cells) {
    for (let i = 0; i < side * side; i++) {
      const cell: Cell = [c - before + (i % side), r - before + Math.floor(i / side)];
      found.set(cell.join(), cell);
    }
  }
  return [...found.values()];
}

/** The connected boxes with the same character, over their four sides. */
export function floodCells(
  from: Cell,
  width: number,
  height: number,
  charAt: (cell: Cell) => string | undefined,
): Cell[] {
  const char = charAt(from);
  if (char === undefined) return [];
  const visited = new Uint8Array(width * height);
  const found: Cell[] = [];
  const open: Cell[] = [from];
  while (open.length > 0) {
    const cell = open.pop()!;
    const [c, r] = cell;
    if (c < 0 || r < 0 || c >= width || r >= height || visited[r * width + c] || charAt(cell) !== char) continue;
    visited[r * width + c] = 1;
    found.push(cell);
    open.push([c + 1, r], [c - 1, r], [c, r + 1], [c, r - 1]);
  }
  return found;
}
