import { describe, expect, test } from "vitest";
import { drawnScenario, AsciiMap, cellOf, cornerPosition, type GridPlacement } from "../../src/edit/ascii-map";
import { changedCells } from "../../src/edit/paint";
import { declaredEditing } from "../fake/editing";
import { brushCells, floodCells, lineCells, rectangleCells, type Cell } from "../../src/edit/cells";

const sorted = (cells: Cell[]): string[] => cells.map((cell) => cell.join()).sort();

describe("boxes", () => {
  test("a flat line covers every column, ends included, in both directions", () => {
    expect(lineCells([0, 0], [6, 2])).toEqual([
      [0, 0],
      [1, 0],
      [2, 1],
      [3, 1],
      [4, 1],
      [5, 2],
      [6, 2],
    ]);
    expect(lineCells([3, 3], [3, 3])).toEqual([[3, 3]]);
    expect(lineCells([2, 5], [2, 2]).length).toBe(4);
    expect(lineCells([4, 4], [0, 0])).toEqual([
      [4, 4],
      [3, 3],
      [2, 2],
      [1, 1],
      [0, 0],
    ]);
  });

  test("a rectangle is a border or filled, from any corner", () => {
    expect(rectangleCells([3, 3], [0, 1], false).length).toBe(10);
    expect(rectangleCells([0, 1], [3, 3], true).length).toBe(12);
    expect(sorted(rectangleCells([3, 1], [0, 3], false))).toEqual(sorted(rectangleCells([0, 1], [3, 3], false)));
    expect(rectangleCells([1, 1], [1, 1], false)).toEqual([[1, 1]]);
  });

  test("a wide brush lists each box once", () => {
    expect(sorted(brushCells([[5, 5]], 2))).toEqual(["5,5", "5,6", "6,5", "6,6"]);
    expect(
      brushCells(
        [
          [5, 5],
          [6, 5],
        ],
        3,
      ).length,
    ).toBe(12);
    expect(brushCells([[5, 5]], 1)).toEqual([[5, 5]]);
  });

  test("filling stays within walls, also at corners", () => {
    const map = new AsciiMap("#####\n#.#.#\n##.##\n#...#\n#####\n", 1);
    const fill = (from: Cell): string[] => sorted(floodCells(from, map.width, map.height, (cell) => map.charAt(cell)));
    expect(fill([1, 3])).toEqual(["1,3"]);
    expect(fill([2, 1])).toEqual(["1,1", "2,1", "2,2", "3,1"]);
    expect(floodCells([9, 9], 5, 5, (cell) => map.charAt(cell))).toEqual([]);
  });
});

describe("a drawn map", () => {
  test("its first line is north: row 0 is the last line", () => {
    const map = new AsciiMap("##\n.#\n", 0.5);
    expect([map.width, map.height]).toEqual([2, 2]);
    expect(map.charAt([0, 0])).toBe(".");
    expect(map.charAt([0, 1])).toBe("#");
    expect(map.charAt([5, 0])).toBe(undefined);
  });

  test("an edit counts lines from the top, and contains only changes", () => {
    const map = new AsciiMap("...\n.#.\n...\n", 1);
    expect(
      map.paint(
        [
          [0, 0],
          [1, 1],
          [2, 2],
          [7, 7],
        ],
        "#",
      ),
    ).toEqual({
      op: "paint",
      key: "map.ascii",
      cells: [
        [2, 0, "#"],
        [0, 2, "#"],
      ],
    });
    expect(map.paint([[1, 1]], "#")).toBe(null);
  });

  test("an empty first line, which the program skips, is counted in an edit", () => {
    expect(new AsciiMap("\n..\n..", 1).paint([[0, 0]], "#")).toEqual({
      op: "paint",
      key: "map.ascii",
      cells: [[2, 0, "#"]],
    });
  });

  test("boxes and meters are converted, also on a rotated ground", () => {
    const turned: GridPlacement = { box_m: 0.25, width: 10, height: 10, origin_m: [3, -2], yaw_rad: 0.7 };
    for (const ground of [turned, { ...turned, yaw_rad: 0, origin_m: [0, 0] as const }]) {
      for (const cell of [
        [0, 0],
        [3, 7],
        [9, 9],
      ] as const) {
        const [x, y] = cornerPosition(ground, cell[0] + 0.5, cell[1] + 0.5);
        expect(cellOf(ground, x, y)).toEqual([...cell]);
      }
    }
    expect(cornerPosition({ ...turned, yaw_rad: 0, origin_m: [0, 0] }, 4, 2)).toEqual([1, 0.5, 0]);
  });

  test("boxes that the view does not show yet are listed, and all where it has another floor", () => {
    const map = new AsciiMap("#.?\n..#\n", 1);
    expect(changedCells(map, Uint8Array.from([0, 0, 1, 1, 0, 1]))).toEqual([]);
    expect(changedCells(map, Uint8Array.from([1, 0, 1, 0, 0, 0]))).toEqual([
      [0, 0],
      [0, 1],
    ]);
    expect(changedCells(map, null).length).toBe(6);
  });

  test("an empty map has the requested size", () => {
    const choice = { name: 'a "hall"', columns: 8, rows: 6, box_m: 0.25 };
    const text = drawnScenario(declaredEditing("robots").drawing!.text, choice);
    expect(text).toContain('name = "a \\"hall\\""');
    expect(text).toContain("at = [[3, 2]]");
    expect(text).toContain('behaviour = { kind = "wander" }');
    const art = /"""\n([^"]*)"""/.exec(text)![1]!;
    const map = new AsciiMap(art, 0.25);
    expect([map.width, map.height]).toEqual([8, 6]);
    expect(map.charAt([0, 3])).toBe("#");
    expect(map.charAt([3, 2])).toBe(".");
  });
});
