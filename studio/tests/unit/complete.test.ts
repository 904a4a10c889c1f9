import { describe, expect, test } from "vitest";
import { completionAt } from "../../src/edit/complete";
import { WorldSchema } from "../../src/edit/schema";
import { modelOf, SCHEMA, TEXT } from "../fake/edit";

const world = new WorldSchema(SCHEMA);

/** Labels at the mark `|` of a text. */
function labels(text: string): string[] | null {
  const at = text.indexOf("|");
  return completionAt(text.replace("|", ""), at, world, modelOf(TEXT))?.options.map(({ label }) => label) ?? null;
}

describe("completions", () => {
  test("keys of the section that the cursor is in", () => {
    expect(labels("|")).toContain("seed");
    expect(labels("[map]\nbo|")).toEqual(["box_size_m", "ascii"]);
    expect(labels("[[robots]]\nsize = 2\nre|")).toContain("regime");
    expect(labels("[[robots]]\n[map]\n|")).toEqual(["box_size_m", "ascii"]);
    expect(labels("map.bo|")).toEqual(["box_size_m", "ascii"]);
  });

  test("keys and values of a table in one line", () => {
    expect(labels("robots = [{ size = 1, re|")).toContain("regime");
    expect(labels("map = { |")).toEqual(["box_size_m", "ascii"]);
    expect(labels('robots = { regime = "|')).toEqual(['"reliable"', '"both"']);
  });

  test("values: choices, booleans, names defined in the text", () => {
    expect(labels('[[robots]]\nregime = "b|')).toEqual(['"reliable"', '"both"']);
    expect(labels("[record]\nevents = |")).toEqual(["true", "false"]);
    expect(labels('[[robots]]\nsensors = ["|')).toEqual(['"sonar-ring"', '"echo"']);
    expect(labels('[[robots]]\nsensors = ["echo", "|')).toEqual(['"sonar-ring"', '"echo"']);
  });

  test("sections in a header, by any name below a table of them", () => {
    expect(labels("[ro|")).toEqual(["map", "sensors", "robots", "record"]);
    expect(labels("[sensors.echo.|")).toEqual(["confusion"]);
  });

  test("nothing in comments, drawn maps and unknown sections", () => {
    expect(labels("# se|")).toBe(null);
    expect(labels('[map]\nascii = """\n##|')).toBe(null);
    expect(labels("seed = 1 # se|")).toBe(null);
    expect(labels("[nowhere]\n|")).toBe(null);
    expect(labels("[[robots]]\nsize = |")).toBe(null);
  });

  test("a completion replaces the typed prefix", () => {
    expect(completionAt("[map]\nbo", 8, world, null)?.from).toBe(6);
    expect(completionAt('[[robots]]\nregime = "b', 22, world, null)?.from).toBe(20);
  });

  test("a completion has a description and the default", () => {
    const seed = completionAt("se", 2, world, null)?.options.find(({ label }) => label === "seed");
    expect(seed?.words).toBe("All randomness grows from it. [1]");
  });
});
