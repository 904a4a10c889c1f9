import { expect, test } from "vitest";
import { TextHistory } from "../../src/edit/history";

test("steps are undone one by one, and redone", () => {
  const history = new TextHistory("a");
  for (let i = 0; i < 5000; i++) history.push(`a${i}`, null, i);
  for (let i = 4998; i >= 0; i--) {
    history.undo();
    expect(history.now).toBe(`a${i}`);
  }
  history.undo();
  expect([history.now, history.canUndo, history.undo()]).toEqual(["a", false, false]);
  history.redo();
  expect(history.now).toBe("a0");
});

test("typing without a pause is one step, and an edit between is a step of its own", () => {
  const history = new TextHistory("");
  history.push("w", "typing", 0);
  history.push("wo", "typing", 300);
  history.push("wor", "typing", 1200);
  history.push("wor!", null, 1300);
  history.push("wor!d", "typing", 1400);
  const seen: string[] = [];
  while (history.undo()) seen.push(history.now);
  expect(seen).toEqual(["wor!", "wor", ""]);
});

test("a pause in typing ends a step", () => {
  const history = new TextHistory("");
  history.push("a", "typing", 0);
  history.push("ab", "typing", 5000);
  history.undo();
  expect(history.now).toBe("a");
});

test("a new step drops undone ones, and an equal text is no step", () => {
  const history = new TextHistory("a");
  history.push("b", null, 0);
  history.push("b", null, 1);
  history.undo();
  expect(history.now).toBe("a");
  history.push("c", null, 2);
  expect([history.canRedo, history.redo(), history.now]).toEqual([false, false, "c"]);
});
