/** The difference of two texts, line by line. */

export interface DiffLine {
  kind: "same" | "mine" | "theirs";
  words: string;
}

/** Maximum number of pairs of lines to match; beyond it the whole middle counts as replaced. */
const MAX_PAIRS = 4_000_000;

/** Returns the lines of both texts, marked as common, only in the first, or only in the second. */
export function diffLines(mine: string, theirs: string): DiffLine[] {
  const [a, b] = [mine.split("\n"), theirs.split("\n")];
  let head = 0;
  while (head < a.length && head < b.length && a[head] === b[head]) head++;
  let tail = 0;
  while (tail < a.length - head && tail < b.length - head && a.at(-1 - tail) === b.at(-1 - tail)) tail++;
  const same = (lines: string[]): DiffLine[] => lines.map((words) => ({ kind: "same", words }));
  const middle = diffMiddle(a.slice(head, a.length - tail), b.slice(head, b.length - tail));
  return [...same(a.slice(0, head)), ...middle, ...same(a.slice(a.length - tail))];
}

function diffMiddle(a: string[], b: string[]): DiffLine[] {
  const mine = (words: string): DiffLine => ({ kind: "mine", words });
  const theirs = (words: string): DiffLine => ({ kind: "theirs", words });
  if (a.length * b.length > MAX_PAIRS) return [...a.map(mine), ...b.map(theirs)];
  const longest = commonLengths(a, b);
  const lines: DiffLine[] = [];
  let [i, j] = [0, 0];
  while (i < a.length || j < b.length) {
    const here = longest[i]?.[j] ?? 0;
    if (i < a.length && j < b.length && a[i] === b[j]) {
      lines.push({ kind: "same", words: a[i++]! });
      j++;
    } else if (i < a.length && (j >= b.length || (longest[i + 1]?.[j] ?? 0) === here)) lines.push(mine(a[i++]!));
    else lines.push(theirs(b[j++]!));
  }
  return lines;
}

/** Lengths of the longest common subsequences of the suffixes from i and j. */
function commonLengths(a: string[], b: string[]): Uint32Array[] {
  const table = Array.from({ length: a.length + 1 }, () => new Uint32Array(b.length + 1));
  for (let i = a.length - 1; i >= 0; i--) {
    for (let j = b.length - 1; j >= 0; j--) {
      table[i]![j] = a[i] === b[j] ? table[i + 1]![j + 1]! + 1 : Math.max(table[i + 1]![j]!, table[i]![j + 1]!);
    }
  }
  return table;
}

/** Only the lines that differ, with some lines of context; null stands for omitted lines. */
export function condense(lines: readonly DiffLine[], context = 2): (DiffLine | null)[] {
  const isNear = (at: number): boolean =>
    lines.slice(Math.max(0, at - context), at + context + 1).some(({ kind }) => kind !== "same");
  const shown: (DiffLine | null)[] = [];
  lines.forEach((line, at) => {
    if (isNear(at)) shown.push(line);
    else if (shown.at(-1) !== null) shown.push(null);
  });
  return shown;
}
