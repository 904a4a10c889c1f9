/**
 * Percepts and decisions of a body in a cycle, and their outcome.
 */
export type Inspection = {
/**
 * The body.
 */
body: BodyId,
/**
 * The cycle that is about to run.
 */
cycle: number,
/**
 * The body's name for people.
 */
title: string,
/**
 * Facts about it, by topic.
 */
sections: Array<FactSection>,
/**
 * Marks to draw over the scene.
 */
marks: Array<Mark>, };

/**
 * Facts about one topic.
 */
export type FactSection = {
/**
 * The topic.
 */
title: string,
/**
 * Single facts.
 */
facts: Array<Fact>,
/**
 * A table of facts of one kind.
 */
table: FactTable | null, };

/**
 * A fact: the question that it answers, and the answer.
 */
export type Fact = { label: string, value: FactValue, };

/**
 * The value of a fact: a number with its unit (empty for plain numbers), a share or probability from 0 to 1, text, a
 * body, a position in meters, yes or no; `none` for nothing, or not known.
 */
export type FactValue = { "number": { value: number, unit: string, } } | { "share": number } | { "text": string } | { "body": BodyId } | { "place": [number, number, number] } | { "flag": boolean } | "none";

/**
 * A table of facts of one kind, e.g. one row per neighbor: headings of the columns, and rows of a value per column.
 */
export type FactTable = { columns: Array<string>, rows: Array<Array<FactValue>>, };

/**
 * Something to draw over the scene.
 */
export type Mark = {
/**
 * Its role in the inspection.
 */
role: MarkRole,
/**
 * Text for it.
 */
label: string,
/**
 * Likelihood or strength, from 0 to 1; 1 where that has no meaning.
 */
weight: number,
/**
 * Its shape.
 */
shape: MarkShape, };

/**
 * The role of a mark in an inspection.
 */
export type MarkRole = "true" | "reported" | "wish" | "done" | "refused" | "claim" | "group" | "predicted" | "chosen" | "known" | "orbit" | "target" | "plan" | "wait";

/**
 * The shape of a mark, in meters: a polyline, a polygon, a point, or a horizontal circle.
 */
export type MarkShape = { "type": "line", points_m: Array<[number, number, number]>, } | { "type": "area", corners_m: Array<[number, number, number]>, } | { "type": "point", at_m: [number, number, number], } | { "type": "circle", at_m: [number, number, number], radius_m: number, };
