// Written from crates/server/src/protocol by
// `SIDESTEP_WRITE=protocol cargo test --release -p sidestep-server protocol`. Do not edit.

/** Version of requests, replies, notifications and frames together. */
export const VERSION = 3;

/**
 * A request. Its reply has the same number, which the page chooses from 1 on: 0 is that of the reply to a request
 * whose number cannot be read.
 */
export type ClientRequest = {
/**
 * The number of the request.
 */
id: number,
/**
 * The method and its arguments.
 */
call: ServerMethod, } | {
/**
 * The number of the request.
 */
id: number,
/**
 * The session.
 */
session: number,
/**
 * The method and its arguments.
 */
call: SessionMethod, };

/**
 * A query or a command for the server itself.
 */
export type ServerMethod = { "do": "files",
/**
 * Its path, as a listing gave it.
 */
folder: string | null, } | { "do": "find",
/**
 * The text; all things contain an empty one.
 */
text: string, } | { "do": "identify",
/**
 * Its path, as a listing or the answer to a dropped file gave it.
 */
path: string, } | { "do": "gallery", } | { "do": "usage", } | { "do": "import-report",
/**
 * Its path, as a listing gave it.
 */
path: string, } | { "do": "open",
/**
 * What to open.
 */
target: OpenTarget,
/**
 * Another seed than the scenario's.
 */
seed: number | null, } | { "do": "runs",
/**
 * Its folder, as a listing gave it.
 */
folder: string, } | { "do": "schema",
/**
 * The world's name.
 */
world: string, };

/**
 * A query or a command for a session.
 */
export type SessionMethod = { "do": "close", } | { "do": "check",
/**
 * The text.
 */
text: string, } | { "do": "edit",
/**
 * The text.
 */
text: string,
/**
 * The changes.
 */
edits: Array<Edit>, } | { "do": "model",
/**
 * The text.
 */
text: string, } | RunMethod;

/**
 * A query or a command for the run of a session.
 */
export type RunMethod = { "do": "play",
/**
 * The speed.
 */
speed: Speed, } | { "do": "pause", } | { "do": "step",
/**
 * Number of cycles.
 */
cycles: number, } | { "do": "seek",
/**
 * The cycle; a run that is over before it stays at its end.
 */
cycle: number, } | { "do": "restart",
/**
 * Another seed.
 */
seed: number | null,
/**
 * Another text for the scenario, which is not saved.
 */
text: string | null, } | { "do": "select-scans",
/**
 * The bodies.
 */
bodies: Array<BodyId>, } | { "do": "credit",
/**
 * Number of frames.
 */
frames: number, } | { "do": "inspect",
/**
 * The body.
 */
body: BodyId, } | { "do": "metrics",
/**
 * The number of the first row wanted.
 */
from: number, } | { "do": "agent-metrics",
/**
 * The name of a metric.
 */
metric: string | null, } | { "do": "find-events",
/**
 * Words that all occur in the sentence, the kind or the names of the bodies of an event, whatever their case.
 */
text: string,
/**
 * The kinds of the events wanted; all without it.
 */
kinds: Array<string> | null,
/**
 * The number of first events to leave out.
 */
skip: number,
/**
 * The largest number of events.
 */
limit: number, } | { "do": "events",
/**
 * The first cycle.
 */
from: number,
/**
 * The cycle after the last one.
 */
until: number,
/**
 * The number of first events to leave out; 0 without it.
 */
skip: number | null,
/**
 * The largest number of events.
 */
limit: number, } | { "do": "trails",
/**
 * The cycle at which they end.
 */
until: number,
/**
 * The bodies; none for all agents.
 */
bodies: Array<BodyId>, } | { "do": "source", } | { "do": "tables", } | { "do": "save",
/**
 * The text.
 */
text: string,
/**
 * The path of the file; the session's own without it.
 */
to: string | null,
/**
 * The text that the file holds as far as the page knows; without it the one that this session has read or
 * written, which another program may have changed before a page was connected again.
 */
base: string | null,
/**
 * Whether a file is replaced even if it holds something else.
 */
overwrite: boolean, };

/**
 * A change of a text. Keys are those of `--set`: `robots.1.at.0`; elements count from 0, and a section that stands
 * alone is 0 or left out. Parts that hold dots or are not bare are quoted: `kinds."a.b".observation`. Everything else
 * in the text stays the same, byte for byte.
 */
export type Edit = { "op": "set",
/**
 * Its key.
 */
key: string,
/**
 * The value, which is not null.
 */
value: unknown, } | { "op": "insert",
/**
 * The key of the array.
 */
key: string,
/**
 * The element's number from then on; the last without it.
 */
at: number | null,
/**
 * The element, which is not null.
 */
value: unknown, } | { "op": "remove",
/**
 * Its key.
 */
key: string, } | { "op": "move",
/**
 * Its key, which ends in its number.
 */
key: string,
/**
 * Its number from then on.
 */
to: number, } | { "op": "rename",
/**
 * The key.
 */
key: string,
/**
 * Its new name, without the tables that it is in.
 */
to: string, } | { "op": "paint",
/**
 * The key of the drawing.
 */
key: string,
/**
 * Row from the top, column from the left, and the new character.
 */
cells: Array<[number, number, string]>, };

/**
 * A thing that can be opened.
 */
export type OpenTarget = { "kind": "scenario",
/**
 * Its path, as a listing gave it.
 */
path: string, } | { "kind": "new",
/**
 * The world's name.
 */
world: string, } | { "kind": "shipped",
/**
 * Its name, as the gallery gave it.
 */
name: string, } | { "kind": "recording",
/**
 * Its path, as a listing gave it.
 */
path: string, } | { "kind": "fleet",
/**
 * The endpoint, as given on the command line.
 */
path: string, };

/**
 * The speed at which a run is played.
 */
export type Speed = { "times": number } | "fastest";

/**
 * The identity of a body: kind, number, and, for things that have parts, the part.
 */
export type BodyId = {
/**
 * Its kind, e.g. `robot`.
 */
kind: string,
/**
 * Its number among those of its kind.
 */
number: number,
/**
 * Its part, where the thing has parts.
 */
part: number | null, };

/**
 * The reply to a request.
 */
export type Reply = {
/**
 * The request's number; 0 for a request that could not be read.
 */
id: number, } & ({ "answer": ReplyBody } | { "problem": Problem });

/**
 * The outcome of a request.
 */
export type ReplyResult = { "answer": ReplyBody } | { "problem": Problem };

/**
 * The answer to a request.
 */
export type ReplyBody = { "is": "done" } | { "is": "files",
/**
 * Its entries that can be opened, by name.
 */
entries: Array<FileEntry>,
/**
 * Number of entries that were not looked at, or are not listed.
 */
left_out: number, } | { "is": "identified",
/**
 * Its entry; of a copy of a file that the server has, the entry of that file.
 */
entry: FileEntry, } | { "is": "gallery",
/**
 * Their entries.
 */
entries: Array<GalleryEntry>, } | { "is": "usage" } & ServerUsage | { "is": "import-report",
/**
 * Format, properties and counts, each with its name.
 */
lines: Array<[string, string]>,
/**
 * What was not taken as it stood, one sentence each.
 */
findings: Array<string>, } | { "is": "opened",
/**
 * Its number.
 */
session: number,
/**
 * The scene, which stays the same.
 */
scene: Scene,
/**
 * Its state.
 */
status: SessionStatus, } | { "is": "inspection" } & Inspection | { "is": "metrics",
/**
 * The metrics.
 */
names: Array<MetricName>,
/**
 * Number of the first row here: the requested one, or the number of all rows.
 */
first: number,
/**
 * The number of cycles done before each row.
 */
cycles: Array<number>,
/**
 * Values in each row, metric by metric; null where a metric has none.
 */
values: Array<Array<number | null>>,
/**
 * The metrics of the session's present cycle; none of a recording that can only be shown.
 */
present: MetricRow | null, } | { "is": "agent-metrics",
/**
 * The metrics that can be asked for; none if one was.
 */
names: Array<MetricName>,
/**
 * The number of cycles done.
 */
cycle: number,
/**
 * The value of the requested metric for each agent, by its number; null where it has none. Empty if none was
 * requested.
 */
values: Array<number | null>, } | { "is": "found-events",
/**
 * The events.
 */
entries: Array<RunEvent>,
/**
 * Number of events found, those that are not here included.
 */
found: number,
/**
 * Number of events that were searched.
 */
searched: number,
/**
 * Number of events that could not be searched, because they were not kept.
 */
left_out: number,
/**
 * The kinds of all events searched, with their numbers.
 */
kinds: Array<[string, number]>, } | { "is": "events",
/**
 * The events.
 */
entries: Array<RunEvent>,
/**
 * Number of events of these cycles that are not here: beyond the requested number, or never kept.
 */
left_out: number,
/**
 * The cycle before which all events are known: of a run those so far, of a recording soon all.
 */
known_until: number, } | { "is": "trails",
/**
 * The trails.
 */
trails: Array<BodyTrail>, } | { "is": "source",
/**
 * Its name in problems.
 */
place: string,
/**
 * The text.
 */
text: string,
/**
 * Whether it cannot be replaced by another text.
 */
read_only: boolean, } | { "is": "tables",
/**
 * The names.
 */
names: Array<string>, } | { "is": "runs",
/**
 * The sweep's name; may be empty.
 */
name: string,
/**
 * Whether these are all runs.
 */
is_complete: boolean,
/**
 * The results that differ between runs, those that the world is about first.
 */
columns: Array<SweepColumn>,
/**
 * Number of results that are equal in all runs, or not listed.
 */
columns_left_out: number,
/**
 * The runs.
 */
runs: Array<SweepRun>,
/**
 * The rule by which a run is an outlier, in words.
 */
outlier_rule: string,
/**
 * Number of runs that are not listed.
 */
left_out: number, } | { "is": "problems",
/**
 * The problems; none for a valid text without surprises.
 */
problems: Array<Problem>, } | { "is": "edited",
/**
 * The text.
 */
text: string, } | { "is": "model",
/**
 * The table of the text: dates are strings; numbers that JSON cannot hold are null.
 */
value: unknown,
/**
 * Files that a key of the text can refer to, by the paths that it would use: those below its folder, and those
 * outside that it refers to.
 */
files: Array<string>, } | { "is": "saved",
/**
 * The file, which is the session's place from now on.
 */
place: string, } | { "is": "differs",
/**
 * The content of the file.
 */
text: string, } | { "is": "schema",
/**
 * JSON Schema, draft 2020-12.
 */
schema: unknown,
/**
 * The tools for the canvas, as `crates/scenario/src/editing.rs` has them.
 */
editing: unknown, };

/**
 * An error as people read it: place, cause, remedy.
 */
export type Problem = {
/**
 * The file, option or request that is wrong.
 */
place: string,
/**
 * Its line, from 1.
 */
line: number | null,
/**
 * Its column, from 1.
 */
column: number | null,
/**
 * Line of its end, from 1.
 */
end_line: number | null,
/**
 * Column after its end, from 1.
 */
end_column: number | null,
/**
 * Key of the scenario that is wrong, as `--set` takes it: `robots.1.at.0`.
 */
key: string | null,
/**
 * The cause.
 */
cause: string,
/**
 * The remedy: the right way to write or to do it.
 */
remedy: string,
/**
 * Whether it is a warning: the text is valid.
 */
is_warning: boolean, };

/**
 * Something in a folder.
 */
export type FileEntry = {
/**
 * Its path for other requests.
 */
path: string,
/**
 * Its name in its folder.
 */
name: string,
/**
 * Its kind.
 */
kind: FileKind,
/**
 * A few words on its content; may be empty.
 */
about: string, };

/**
 * The kind of a file or a folder.
 */
export type FileKind = "folder" | "scenario" | "run" | "recording" | "sweep" | "foreign" | "map" | "model" | "profile";

/**
 * A scenario that the program carries.
 */
export type GalleryEntry = {
/**
 * Its name for other requests.
 */
name: string,
/**
 * The name of its world.
 */
world: string,
/**
 * Its title.
 */
title: string,
/**
 * A sentence on it.
 */
about: string, };

/**
 * The memory that a server uses, by what it is for.
 */
export type ServerUsage = {
/**
 * What is kept, of each session and of all together.
 */
stores: Array<StoreUsage>,
/**
 * Bytes of memory of the whole process; none where the system does not tell.
 */
resident_bytes: number | null,
/**
 * Number of open sessions, of all pages.
 */
sessions: number,
/**
 * Maximum number of open sessions.
 */
max_sessions: number, };

/**
 * The memory of something that grows with use.
 */
export type StoreUsage = {
/**
 * The session that it belongs to; none for what all share.
 */
session: number | null,
/**
 * What is kept, for people.
 */
name: string,
/**
 * Its bytes.
 */
bytes: number,
/**
 * The bytes that it never exceeds.
 */
max_bytes: number, };

/**
 * A metric.
 */
export type MetricName = {
/**
 * Its name in results.
 */
key: string,
/**
 * A short label.
 */
label: string,
/**
 * Its unit; may be empty.
 */
unit: string,
/**
 * Whether it is among those that the world is about, which charts show without being asked. They come first.
 */
is_primary: boolean, };

/**
 * The metrics at one cycle.
 */
export type MetricRow = {
/**
 * The number of cycles done.
 */
cycle: number,
/**
 * A value for each metric; null where it has none.
 */
values: Array<number | null>, };

/**
 * A message of the server without a request.
 */
export type ServerNotification = { "notice": "hello",
/**
 * See [`VERSION`](super::VERSION).
 */
version: number,
/**
 * The program and its build.
 */
program: string,
/**
 * The names of all worlds.
 */
worlds: Array<string>,
/**
 * Whether texts of the page are refused.
 */
read_only: boolean,
/**
 * The things that the command line asked to open.
 */
open: Array<TargetRef>, } | { "notice": "bodies" } & BodyTable | { "notice": "status" } & SessionStatus | { "notice": "ended",
/**
 * The session.
 */
session: number,
/**
 * The reason.
 */
problem: Problem, };

/**
 * Something that the command line asked to open: a kind as in [`OpenTarget`](super::OpenTarget), with its path.
 */
export type TargetRef = {
/**
 * `scenario`, `recording`, `sweep` or `fleet`.
 */
kind: string,
/**
 * Its path, or the endpoint of a fleet.
 */
path: string, };

/**
 * The state of a session.
 */
export type SessionStatus = {
/**
 * The session.
 */
session: number,
/**
 * Its activity.
 */
state: SessionState,
/**
 * Cycles done.
 */
cycle: number,
/**
 * Number of cycles of the whole run; of a recording, those that were recorded.
 */
cycles_planned: number,
/**
 * Simulated seconds since the start.
 */
time_s: number,
/**
 * Its speed now, or when it was last playing.
 */
speed: Speed,
/**
 * Cycles per second over the last second.
 */
cycles_per_s: number,
/**
 * The seed, in decimal digits, because it may be larger than any exact integer of JavaScript.
 */
seed: string,
/**
 * Digest of the state, while the run is paused or over.
 */
digest: string | null,
/**
 * The verdict on a recording: whether its digest was confirmed, or will be.
 */
banner: string | null,
/**
 * The nodes of a fleet.
 */
fleet: Fleet | null, };

/**
 * The activity of a session.
 */
export type SessionState = "playing" | "paused" | "seeking" | "watched" | "over" | "failed";

/**
 * A fleet at one moment.
 */
export type Fleet = {
/**
 * Whether all nodes have joined.
 */
has_begun: boolean,
/**
 * Seconds since its server was last heard.
 */
silent_s: number,
/**
 * Number of cycles that began late, in real time.
 */
late_cycles: number,
/**
 * Median time in milliseconds from the percepts of a cycle to its last control.
 */
talk_p50_ms: number | null,
/**
 * The time in milliseconds below which 99 of 100 of them are.
 */
talk_p99_ms: number | null,
/**
 * The nodes, by rising number of the agent.
 */
nodes: Array<FleetNode>, };

/**
 * The node of an agent.
 */
export type FleetNode = {
/**
 * The agent's number on the network.
 */
agent: number,
/**
 * The body that shows the agent.
 */
body: BodyId,
/**
 * A word for its state: `awaited`, `joined`, `gone`, or its part in the cycle.
 */
state: string,
/**
 * Epoch of the coordinator that it follows.
 */
epoch: number,
/**
 * Numbers on the network of the agents that it has heard in the last cycle.
 */
heard: Array<number>,
/**
 * The round of its talk.
 */
round: number,
/**
 * Number of its controls that were flown.
 */
flown: number,
/**
 * Number of its controls that came late, or not at all.
 */
late: number,
/**
 * Number of times that it has joined.
 */
lives: number,
/**
 * Packets that it sends in a second.
 */
packets_per_s: number,
/**
 * Bytes that it sends in a second.
 */
bytes_per_s: number,
/**
 * Seconds since the server last heard it; none if it never has.
 */
silent_s: number | null, };

/**
 * The scene, which stays the same.
 */
export type Scene = {
/**
 * The scenario's name; may be empty.
 */
name: string,
/**
 * The world's name.
 */
world: string,
/**
 * The noun for an agent, e.g. `robot`.
 */
agent: string,
/**
 * 2 where everything lies in a plane, else 3.
 */
dimensions: number,
/**
 * Simulated seconds per cycle.
 */
cycle_s: number,
/**
 * The floor, where it is known box by box.
 */
floor: OccupancyGrid | null,
/**
 * Walls, obstacles at rest, starts and goals.
 */
bodies: Array<StaticBody>,
/**
 * Agents that the scenario describes together.
 */
groups: Array<SceneGroup>,
/**
 * The names of all bodies that have some, also of those that are not there yet, or gone.
 */
names: Array<BodyName>,
/**
 * Whether a recorded run is computed again.
 */
is_recording: boolean,
/**
 * What a plan view shows of traffic; none where the scene is no traffic.
 */
traffic: Traffic | null, };

/**
 * The name of a body, which all its parts share.
 */
export type BodyName = {
/**
 * Its kind.
 */
kind: string,
/**
 * Its number among the bodies of its kind.
 */
number: number,
/**
 * Its name.
 */
name: string, };

/**
 * Agents that the scenario describes together, such as couriers.
 */
export type SceneGroup = {
/**
 * Their name.
 */
name: string,
/**
 * Their kind.
 */
kind: string,
/**
 * The number of the first of them.
 */
first: number,
/**
 * How many they are; their numbers follow each other.
 */
count: number, };

/**
 * A floor of square boxes, along the axes of its own plane.
 */
export type OccupancyGrid = {
/**
 * Boxes along the first axis.
 */
width: number,
/**
 * Boxes along the second axis.
 */
height: number,
/**
 * Side of a box, in meters.
 */
box_m: number,
/**
 * The corner of the first box.
 */
origin_m: [number, number],
/**
 * The turn about that corner.
 */
yaw_rad: number,
/**
 * Runs of equal boxes, row by row from the first: `[code, count, code, count, ...]`; 0 free, 1 wall, 2 unknown.
 */
runs: Array<number>, };

/**
 * A body that never moves.
 */
export type StaticBody = {
/**
 * The body.
 */
id: BodyId,
/**
 * Its own name, if it has one.
 */
name: string | null,
/**
 * Its place, in meters.
 */
at_m: [number, number, number],
/**
 * Its orientation: a unit quaternion x, y, z, w.
 */
orientation: [number, number, number, number],
/**
 * Its shape.
 */
shape: Shape,
/**
 * Its appearance.
 */
appearance: Appearance, };

/**
 * The shape of a body, around its pose.
 */
export type Shape = { "type": "cuboid",
/**
 * Its extent along its axes, in meters.
 */
size_m: [number, number, number], } | { "type": "cylinder",
/**
 * Its radius, in meters.
 */
radius_m: number,
/**
 * Its extent along its third axis, in meters.
 */
height_m: number, } | { "type": "sphere",
/**
 * Its radius, in meters.
 */
radius_m: number, } | { "type": "line",
/**
 * Its points, in meters; none for moving bodies, because the frames have them.
 */
points_m: Array<[number, number, number]>,
/**
 * Its thickness in meters; 0 for the thinnest line that can be drawn.
 */
thickness_m: number, } | { "type": "dart",
/**
 * Length from tail to tip, in meters.
 */
length_m: number,
/**
 * Width, in meters.
 */
width_m: number, };

/**
 * The appearance of a body, apart from its shape. Colors per condition come from the one table of the kernel.
 */
export type Appearance = {
/**
 * Red, green and blue.
 */
color: [number, number, number],
/**
 * Opacity, from 0 (fully transparent) to 1 (opaque).
 */
opacity: number,
/**
 * Seen from above, higher layers cover lower ones.
 */
layer: number, };

/**
 * Bodies that move, in columns: body i is `kinds[kind[i]]`, `number[i]`, `part[i]` (-1: none), `shapes[shape[i]]`,
 * `appearances[appearance[i]]`.
 */
export type BodyTable = {
/**
 * The session.
 */
session: number,
/**
 * Its number, to which frames refer.
 */
id: number,
/**
 * The names of kinds.
 */
kinds: Array<string>,
/**
 * The kind of each body.
 */
kind: Array<number>,
/**
 * The number of each body among those of its kind.
 */
number: Array<number>,
/**
 * The part that each body is.
 */
part: Array<number>,
/**
 * Shapes; of a line without its points, which are in the frames.
 */
shapes: Array<Shape>,
/**
 * The shape of each body.
 */
shape: Array<number>,
/**
 * Appearances, each for the five conditions.
 */
appearances: Array<[Appearance, Appearance, Appearance, Appearance, Appearance]>,
/**
 * The appearance of each body.
 */
appearance: Array<number>,
/**
 * Names of the bodies that have one: index of the body, name.
 */
names: Array<[number, string]>,
/**
 * The bodies that are agents, which can be inspected.
 */
is_agent: Array<boolean>, };

/**
 * What a plan view of traffic shows beside its bodies.
 */
export type Traffic = {
/**
 * Where on earth places are; none where they are in a plane of their own.
 */
chart: EarthChart | null,
/**
 * The altitude of all traffic, in meters, where all of it is on one level.
 */
level_m: number | null,
/**
 * The areas.
 */
areas: Array<TrafficArea>,
/**
 * The routes as they are filed.
 */
routes: Array<TrafficRoute>, };

/**
 * A map of the earth: x east and y north of its origin, in meters.
 */
export type EarthChart = {
/**
 * Latitude and longitude of the origin, in degrees.
 */
origin_deg: [number, number],
/**
 * Radius in meters of a sphere whose longitudes are as long as at the origin; none where each place lies as far
 * from the origin, and in the direction, in which it is on the WGS84 ellipsoid.
 */
sphere_radius_m: number | null, };

/**
 * An area, whose borders are bodies of this kind and number.
 */
export type TrafficArea = {
/**
 * The kind of its borders.
 */
kind: string,
/**
 * Its number.
 */
number: number,
/**
 * Its name.
 */
name: string,
/**
 * Whether traffic stays inside of it, not outside.
 */
is_fence: boolean,
/**
 * The lowest altitude, in meters; none where it begins at the ground.
 */
low_m: number | null,
/**
 * The highest altitude, in meters; none where it has no end.
 */
high_m: number | null, };

/**
 * A route as it is filed.
 */
export type TrafficRoute = {
/**
 * The agent.
 */
agent: BodyId,
/**
 * Its start and its way-points, in meters.
 */
points_m: Array<[number, number, number]>, };

/**
 * The trail of a body up to a cycle.
 */
export type BodyTrail = {
/**
 * The body.
 */
body: BodyId,
/**
 * The cycles of its points, the earliest first.
 */
cycles: Array<number>,
/**
 * Its points, in meters: x, y and z of each in turn.
 */
points_m: Array<number>, };

/**
 * A result of a run that is far from those of the other runs of its variant.
 */
export type SweepOutlier = {
/**
 * The place of its column.
 */
column: number,
/**
 * Whether it is above the others.
 */
is_high: boolean,
/**
 * Its distance from the nearer quartile in interquartile ranges; null where the quartiles are equal.
 */
distance_ranges: number | null, };

/**
 * A run of a sweep.
 */
export type SweepRun = {
/**
 * The name of its variant.
 */
variant: string,
/**
 * Its seed, in decimal digits, because it may be larger than any exact integer of JavaScript.
 */
seed: string,
/**
 * The cause of its failure; empty if it did not fail.
 */
failure: string,
/**
 * Its recording; or its variant's scenario, which needs the seed.
 */
replay: TargetRef,
/**
 * Its results, column by column; null where it has none.
 */
values: Array<number | null>,
/**
 * The results that are far from those of the other runs of its variant.
 */
outliers: Array<SweepOutlier>, };

/**
 * A result of the runs of a sweep.
 */
export type SweepColumn = {
/**
 * Its name in results.
 */
key: string,
/**
 * A short label.
 */
label: string,
/**
 * Its unit; may be empty.
 */
unit: string, };

/**
 * The text at the end of a frame.
 */
export type FrameText = {
/**
 * The scans of the selected bodies.
 */
scans: Array<Scan>,
/**
 * The last events since the frame before.
 */
events: Array<RunEvent>,
/**
 * Number of events since the frame before that are not here.
 */
events_left_out: number, };

/**
 * Ranges of one sensor.
 */
export type Scan = {
/**
 * The body with the sensor.
 */
body: BodyId,
/**
 * The sensor's name.
 */
sensor: string,
/**
 * The sensor's place, in meters.
 */
at_m: [number, number, number],
/**
 * The direction of its bearing 0: a unit quaternion x, y, z, w.
 */
orientation: [number, number, number, number],
/**
 * Bearing of each beam, in radians.
 */
bearings_rad: Array<number>,
/**
 * Range of each beam in meters, as reported; null: nothing in range.
 */
ranges_m: Array<number | null>,
/**
 * The true range of each beam in meters; empty where the world does not give it.
 */
true_m: Array<number | null>,
/**
 * The maximum range, in meters.
 */
range_m: number, };

/**
 * An event of a run.
 */
export type RunEvent = {
/**
 * The cycle in which it happened.
 */
cycle: number,
/**
 * `info`, `warning` or `error`.
 */
level: string,
/**
 * A word of the fixed vocabulary of events, e.g. `contact`, `veto`, `trip`; empty where the world gives none.
 */
kind: string,
/**
 * The body concerned.
 */
body: BodyId | null,
/**
 * The other body or thing that took part, if any.
 */
other: BodyId | null,
/**
 * Its place, in meters.
 */
at_m: [number, number, number] | null,
/**
 * Its value, if it has one.
 */
value: number | null,
/**
 * The value's unit; may be empty.
 */
unit: string,
/**
 * The event as text.
 */
text: string, };

/**
 * All that a replay in one file holds.
 */
export type ReplayFile = {
/**
 * See [`VERSION`](super::VERSION).
 */
version: number,
/**
 * The program that made it, and its build.
 */
program: string,
/**
 * The runs, which are opened in this order.
 */
runs: Array<ReplayRun>, };

/**
 * A recorded run in a replay.
 */
export type ReplayRun = {
/**
 * The name of the recording, without the folder that it was in.
 */
name: string,
/**
 * The scene.
 */
scene: Scene,
/**
 * The state at the first frame.
 */
status: SessionStatus,
/**
 * Digest of the state at the last frame; none if the run ends later.
 */
digest: string | null,
/**
 * The part with the digest of each frame, 16 bytes, by which two runs are compared; none of a single run.
 */
digests: number | null,
/**
 * The cycles of the frames: first cycle, cycles between two frames, number of frames.
 */
cycles: Array<[number, number, number]>,
/**
 * The parts with body tables, in the order of their numbers from 1 on.
 */
tables: Array<ReplayTables>,
/**
 * The part with the reply to the request for the scenario.
 */
source: number,
/**
 * The part with the reply to the request for all rows of metrics.
 */
metrics: number,
/**
 * The metrics of each agent, at some of the cycles; none in a world without any.
 */
agents: ReplayAgentMetrics | null,
/**
 * The parts with frames, in their order.
 */
chunks: Array<ReplayChunk>,
/**
 * The parts with events, in their order.
 */
events: Array<ReplaySpan>,
/**
 * Number of events that are not in the file.
 */
events_left_out: number,
/**
 * Cycles with such events, and their numbers; cycles near each other are counted together.
 */
events_lost: Array<[number, number]>,
/**
 * The parts with inspections, in their order.
 */
inspections: Array<ReplaySpan>,
/**
 * What can be inspected, in words.
 */
inspected: string, };

/**
 * The metrics of each agent over time.
 */
export type ReplayAgentMetrics = {
/**
 * The metrics.
 */
names: Array<MetricName>,
/**
 * Number of agents.
 */
agents: number,
/**
 * The number of cycles done before each row.
 */
cycles: Array<number>,
/**
 * For each metric, the part with its values, as a plane with a channel for each agent and a time for each row.
 */
parts: Array<number>, };

/**
 * A part with body tables, see [`ReplayTablesPart`].
 */
export type ReplayTables = {
/**
 * Its number.
 */
part: number,
/**
 * Number of tables.
 */
tables: number, };

/**
 * Some consecutive body tables: each is a selection of the bodies of all.
 */
export type ReplayTablesPart = {
/**
 * The bodies of all tables, in the order that all have. Its session and its number mean nothing.
 */
all: BodyTable,
/**
 * For each table the bodies that come or go with it; before the first one there is none.
 */
changes: Array<Array<number>>, };

/**
 * A part with frames.
 */
export type ReplayChunk = {
/**
 * Its number.
 */
part: number,
/**
 * Number of frames.
 */
frames: number, };

/**
 * A part with things of some cycles.
 */
export type ReplaySpan = {
/**
 * Its number.
 */
part: number,
/**
 * The cycle of its first item.
 */
from: number,
/**
 * The cycle of its last item.
 */
until: number,
/**
 * Number of items.
 */
count: number, };

/**
 * Events as columns: item i of each column belongs to event i. Fields are those of a `RunEvent`.
 */
export type ReplayEvents = {
/**
 * The cycles since the event before; of the first event, its cycle.
 */
cycle: Array<number>,
/**
 * Severities.
 */
level: Array<string>,
/**
 * Kinds.
 */
kind: Array<string>,
/**
 * The bodies concerned.
 */
body: Array<BodyId | null>,
/**
 * The others that took part.
 */
other: Array<BodyId | null>,
/**
 * Places in meters.
 */
at_m: Array<[number, number, number] | null>,
/**
 * Values.
 */
value: Array<number | null>,
/**
 * Units of the values.
 */
unit: Array<string>,
/**
 * The events as text.
 */
text: Array<string>, };

/**
 * What an agent perceived, decided and did in a cycle.
 */
export type ReplayInspection = {
/**
 * The inspection, with its cycle.
 */
inspection: Inspection,
/**
 * The scans of the body.
 */
scans: Array<Scan>, };

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
