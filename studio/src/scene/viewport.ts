/** The canvas of one session: draws only when a frame, the camera or an option changes. */

import { Color, Group, Scene as Graph, SRGBColorSpace, WebGLRenderer, type Mesh } from "three";
import type { Frame } from "../decode";
import type { BodyTrail, Inspection, Point3, MarkRole, Scene, BodyId } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { Link } from "../fleet/links";
import type { Projection, TrailMode } from "../state/display.svelte";
import type { TrailRequest } from "../state/trail-source";
import { PlaneCamera, SpaceCamera, type Extent, type Camera } from "./camera";
import { BodyColors, type ColorOptions } from "./body-colors";
import type { ColorLegend } from "./coloring";
import { extentOf, flatRadiusOf } from "./extent";
import { GlassLayer } from "./glass-layer";
import { FloorLayer } from "./floor";
import { drawGrid } from "./grid";
import { drawColorLegend } from "./color-legend";
import { drawLegend } from "./legend";
import { drawMarks, drawScans, fillAreas } from "./marks";
import { Overlay, type Label } from "./overlay";
import { paletteOf, ROLES, visibleColor, packColor, type Palette } from "./palette";
import { pick } from "./pick";
import { isPlan, PlanPainter, SYMBOL_PX } from "./plan";
import { planOf, type PlanState, type PlanView } from "./plan-view";
import { PlanePainter } from "./plane";
import { profileHeight_px } from "./profile";
import { SpacePainter } from "./space";
import { Strokes } from "./strokes";
import { bodiesWithTrails, drawTrail } from "./trail-lines";
import { Trails } from "./trails";

/** The scale of a picture. */
export interface ViewScale {
  pxPerM: number;
  palette: Palette;
  width_px: number;
  height_px: number;
  /** Pixels of the canvas for each of the page: an image that is saved has more of them. */
  ratio: number;
}

/** Draws the bodies of one kind of world. */
export interface Painter {
  readonly group: Group;
  paint(palette: Palette): void;
  setBodies(bodies: Bodies, palette: Palette): void;
  frame(frame: Frame): void;
  /**
   * Sets colors for bodies instead of their own, none for those with 0; whether agents are left out, and whether colors
   * tell states.
   */
  setColors?(tints: Uint32Array | null, hidesAgents: boolean, tellsStates: boolean): void;
  scale(scale: ViewScale): void;
  dispose(): void;
}

/** Options of the page: what the viewport shows. */
export interface ViewOptions extends ColorOptions {
  selected: BodyId | null;
  inspection: Inspection | null;
  trails: TrailMode;
  widthIsTrue: boolean;
  /** Whether the selected body stays in the center. */
  follows: boolean;
  /** Pairs that hear each other in a fleet, by the bodies' indices. */
  links: readonly Link[];
  /** Whether a plan has a vertical profile below it. */
  hasProfile: boolean;
}

/** Pixels of an image for each of the page: text and lines stay sharp in print. */
const IMAGE_RATIO = 2;

/** Bodies with names of their own are labeled up to this number. */
const MAX_LABELS = 40;

/** Pixels of the screen for each of the page, as far as they are worth their cost. */
function screenRatio(): number {
  return Math.min(2, window.devicePixelRatio);
}

/** A renderer with minimal features: an opaque canvas without depth is cheap to compose. */
function createRenderer(canvas: HTMLCanvasElement, isSpace: boolean): WebGLRenderer {
  const attributes = {
    alpha: false,
    antialias: isSpace,
    depth: isSpace,
    stencil: false,
    powerPreference: "high-performance",
  } as const;
  const context = canvas.getContext("webgl2", attributes) as WebGL2RenderingContext | null;
  if (!context) throw new Error("no WebGL 2");
  return new WebGLRenderer({ canvas, context, ...attributes });
}

/** Returns the painter of a scene's bodies, and its floor. */
function createLayers(scene: Scene, projection: Projection): [Painter, FloorLayer | null] {
  const floor = scene.floor ? new FloorLayer(scene.floor) : null;
  if (isPlan(scene, projection)) return [new PlanPainter(scene), floor];
  return [scene.dimensions === 2 ? new PlanePainter(scene) : new SpacePainter(scene), floor];
}

/** Returns whether a camera of one scene fits another: places mean the same in both. */
function hasSameExtent(a: Scene, b: Scene): boolean {
  const measure = ({ world, floor, traffic }: Scene): string =>
    JSON.stringify([world, floor?.width, floor?.height, floor?.box_m, floor?.origin_m, traffic?.chart]);
  return measure(a) === measure(b);
}

export class Viewport {
  readonly camera: Camera;
  /** Called after each draw, with the roles of the visible marks. */
  onDrawn: (roles: ReadonlySet<MarkRole>) => void = () => undefined;
  /** Called when the meaning of colors has changed; null where bodies have their own. */
  onLegend: (legend: ColorLegend | null) => void = () => undefined;
  /** Called after the user has moved the camera. */
  onMoved: () => void = () => undefined;
  /** Also called after each draw: overlays follow the camera. */
  readonly drawListeners = new Set<() => void>();
  /** Called when trails that are shown lack positions, which were never displayed. */
  onTrailGap: (request: TrailRequest) => void = () => undefined;
  /** Number of draws so far. */
  pictures = 0;
  readonly #projection: Projection;
  readonly #renderer: WebGLRenderer;
  readonly #overlay: Overlay;
  readonly #graph = new Graph();
  readonly #areas = new Group();
  #painter: Painter;
  #plan: PlanView | null;
  #floor: FloorLayer | null;
  #glass: GlassLayer | null = null;
  readonly #grid = new Strokes(1);
  readonly #trailStrokes = new Strokes(4);
  readonly #marks = new Strokes(8);
  #scene: Scene;
  #palette: Palette;
  #bodies: Bodies | null = null;
  #frame: Frame | null = null;
  #trails: Trails | null = null;
  /** The number of the gap that was asked for with the present mode and selection. */
  #requestedGap: number | null = null;
  #colors: BodyColors | null = null;
  #legend = "";
  #options: ViewOptions = {
    selected: null,
    inspection: null,
    trails: "none",
    widthIsTrue: false,
    follows: false,
    colors: "own",
    density: "auto",
    agentValues: null,
    links: [],
    hasProfile: true,
  };
  #hovered: number | undefined;
  #extent: Extent;
  #size: [number, number] = [1, 1];
  #isFitted = false;
  /** Whether the camera still shows everything, as it was not moved: then it does so after a resize too. */
  #isWhole = false;
  #request = 0;
  #bodiesChanged = true;
  #marksChanged = true;
  #viewChanged = true;
  #roles: ReadonlySet<MarkRole> = new Set();

  constructor(
    canvas: HTMLCanvasElement,
    overlay: HTMLCanvasElement,
    scene: Scene,
    isDark: boolean,
    camera?: Camera,
    projection: Projection = "plan",
  ) {
    const isPlane = scene.dimensions === 2 || isPlan(scene, projection);
    this.#projection = projection;
    this.#renderer = createRenderer(canvas, !isPlane);
    this.#renderer.setPixelRatio(screenRatio());
    this.#overlay = new Overlay(overlay);
    this.#scene = scene;
    this.#palette = paletteOf(isDark);
    this.#isFitted = camera !== undefined && camera instanceof PlaneCamera === isPlane;
    this.camera = this.#isFitted ? camera! : isPlane ? new PlaneCamera() : new SpaceCamera();
    [this.#painter, this.#floor] = createLayers(scene, projection);
    this.#plan = planOf(this.#painter, scene);
    if (this.#floor) this.#graph.add(this.#floor.mesh, this.#floor.walls);
    for (const strokes of [this.#grid, this.#trailStrokes, this.#marks]) this.#graph.add(strokes.quads.mesh);
    this.#graph.add(this.#painter.group, this.#areas);
    this.#extent = extentOf(scene, null, null);
    this.setTheme(isDark);
    this.#takeGlass();
    canvas.addEventListener("webglcontextrestored", () => this.#glass?.invalidate());
  }

  /** Draws glass bodies apart, where the painter wants it. */
  #takeGlass(): void {
    if (this.#glass) this.#graph.remove(this.#glass.mesh);
    this.#glass?.dispose();
    const glass = this.#painter instanceof SpacePainter ? this.#painter.takeGlass() : null;
    this.#glass = glass && new GlassLayer(glass);
    if (this.#glass) this.#graph.add(this.#glass.mesh);
  }

  setTheme(isDark: boolean): void {
    this.#palette = paletteOf(isDark);
    this.#floor?.paint(this.#palette);
    this.#painter.paint(this.#palette);
    this.#glass?.invalidate();
    const back = this.#floor ? this.#palette.background : this.#palette.free;
    this.#renderer.setClearColor(new Color().setRGB(back[0] / 255, back[1] / 255, back[2] / 255, SRGBColorSpace));
    this.#bodiesChanged = this.#marksChanged = true;
    this.requestDraw();
  }

  /** Shows another scene of the same dimensions, as after an edit; the old frame stays until its first one. */
  setScene(scene: Scene): void {
    if (scene === this.#scene) return;
    if (!hasSameExtent(scene, this.#scene)) this.#isFitted = false;
    this.#scene = scene;
    this.#painter.dispose();
    this.#floor?.dispose();
    this.#graph.remove(this.#painter.group);
    if (this.#floor) this.#graph.remove(this.#floor.mesh, this.#floor.walls);
    [this.#painter, this.#floor] = createLayers(scene, this.#projection);
    this.#plan = planOf(this.#painter, scene);
    this.#graph.add(this.#painter.group);
    if (this.#floor) this.#graph.add(this.#floor.mesh, this.#floor.walls);
    if (this.#bodies) this.#painter.setBodies(this.#bodies, this.#palette);
    this.#extent = extentOf(scene, null, null);
    this.setTheme(this.#palette.isDark);
    this.#takeGlass();
  }

  resize(width_px: number, height_px: number): void {
    if (width_px < 2 || height_px < 2) return;
    this.#size = [width_px, height_px];
    this.#plan?.forgetPlaces();
    this.#renderer.setSize(width_px, height_px, false);
    this.#overlay.resize(width_px, height_px, screenRatio());
    this.camera.resize(width_px, height_px);
    this.#reserveProfile();
    if (!this.#isFitted || this.#isWhole) this.camera.fit(this.#extent);
    this.requestDraw();
  }

  setBodies(bodies: Bodies): void {
    const [before, trails] = [this.#bodies, new Trails(bodies.count, this.#scene.dimensions === 2 ? 2 : 3)];
    // Whenever a body comes or goes, the others get other numbers.
    if (before && this.#trails) trails.adopt(this.#trails, (index) => bodies.find(before.bodyId(index)));
    this.#bodies = bodies;
    this.#trails = trails;
    this.#dropColors();
    this.#colors = new BodyColors(bodies, this.#scene);
    this.#graph.add(this.#colors.density.mesh);
    this.#painter.setBodies(bodies, this.#palette);
    this.#frame = null;
  }

  /** Shows a frame; after a seek it need not follow the previous one. */
  frame(frame: Frame, isSought = false): void {
    // A frame may come before its body table is set: its columns belong to other bodies.
    if (frame === this.#frame || frame.tableId !== this.#bodies?.table.id) return;
    const isFirst = this.#frame === null;
    this.#frame = frame;
    if (isSought) this.#plan?.forgetPlaces();
    this.#trails?.push(frame.cycle, frame.positions_m, isSought);
    this.#colors?.push(frame, isSought);
    this.#completeTrails();
    if (isFirst) this.#extent = extentOf(this.#scene, this.#bodies, frame);
    if (isFirst && !this.#isFitted) this.fit();
    this.#follow();
    this.#bodiesChanged = this.#marksChanged = true;
    this.requestDraw();
  }

  /** Has the trails completed that are shown and have a gap, once for each gap: while frames come, the reply is awaited. */
  #completeTrails(): void {
    const bodies = this.#bodies;
    const trails = this.#trails;
    if (!bodies || !trails || this.#requestedGap === trails.gapNumber) return;
    const { trails: mode, selected } = this.#options;
    if (!trails.hasGap(bodiesWithTrails(bodies, mode, selected))) return;
    this.#requestedGap = trails.gapNumber;
    this.onTrailGap({ until: trails.lastCycle, bodies: mode === "all" || !selected ? [] : [selected] });
  }

  /** Takes the trails of a request, as the server knows them. */
  loadTrails(received: readonly BodyTrail[], { until, bodies: wanted }: TrailRequest): void {
    const bodies = this.#bodies;
    const trails = this.#trails;
    // The run has gone back since: these end later.
    if (!bodies || !trails || trails.lastCycle < until) return;
    const indices = wanted.flatMap((body) => bodies.find(body) ?? []);
    const indexOf = ({ body }: BodyTrail): number | undefined => bodies.find(body);
    trails.load(received, until, wanted.length === 0 ? bodies.agents : indices, indexOf);
    this.#marksChanged = true;
    this.requestDraw();
  }

  setOptions(options: ViewOptions): void {
    const { trails, selected } = this.#options;
    this.#options = options;
    if (options.trails !== trails || options.selected !== selected) {
      this.#requestedGap = null;
      this.#completeTrails();
    }
    this.#reserveProfile();
    this.#focus();
    this.#marksChanged = true;
    this.#follow();
    this.requestDraw();
  }

  /** Tells a plan which aircraft are in focus. */
  #focus(): void {
    this.#plan?.painter.setFocus(this.#options.selected, this.#hovered);
  }

  /** The height of the profile below a plan. */
  get #profile_px(): number {
    const hasOne = this.#plan !== null && this.#scene.dimensions === 3 && this.#options.hasProfile;
    return hasOne ? profileHeight_px(this.#size[1]) : 0;
  }

  /** Fits the scene above the profile. */
  #reserveProfile(): void {
    if (!(this.camera instanceof PlaneCamera) || this.camera.covered_px === this.#profile_px) return;
    this.camera.covered_px = this.#profile_px;
    if (this.#isWhole) this.camera.fit(this.#extent);
  }

  /** Centers the selected body, if the view follows it. */
  #follow(): void {
    const { follows, selected } = this.#options;
    const index = follows && selected ? this.#bodies?.find(selected) : undefined;
    const at = index === undefined ? null : this.positionOf(index);
    if (!at) return;
    this.camera.center(at);
    this.#isWhole = false;
  }

  /** Shows everything. */
  fit(): void {
    if (this.#frame) this.#extent = extentOf(this.#scene, this.#bodies, this.#frame);
    this.camera.fit(this.#extent);
    this.#isFitted = this.#isWhole = this.#frame !== null && this.#size[0] > 1;
    this.requestDraw();
  }

  /** Zooms in on the center by a factor. */
  zoom(factor: number): void {
    this.camera.zoom(factor, this.#size[0] / 2, this.#size[1] / 2);
    this.onCameraMove();
  }

  /** Centers a body. */
  center(index: number): void {
    const at = this.positionOf(index);
    if (!at) return;
    this.camera.center(at);
    this.onCameraMove();
  }

  /** Centers a body unless it is visible. */
  show(index: number): void {
    const at = this.positionOf(index);
    if (!at) return;
    const [x, y, inFront] = this.camera.project(...at);
    const isSeen = inFront && x > 0 && y > 0 && x < this.#size[0] && y < this.#size[1];
    if (!isSeen) this.center(index);
  }

  /** Called when the user has moved the camera. */
  onCameraMove(): void {
    this.#isWhole = false;
    this.onMoved();
    this.requestDraw();
  }

  /** Shows what another viewport of the same world shows, so that the two can be compared. */
  takeCamera(other: Viewport): void {
    if (!hasSameExtent(other.#scene, this.#scene) || !this.camera.take(other.camera)) return;
    this.#isFitted = true;
    this.#isWhole = false;
    this.requestDraw();
  }

  /** Returns whether the user has moved the camera. */
  get isMoved(): boolean {
    return this.#isFitted && !this.#isWhole;
  }

  /** Schedules a draw. */
  requestDraw(): void {
    this.#viewChanged = true;
    if (this.#request === 0) this.#request = requestAnimationFrame(() => this.#draw());
  }

  agentAt(x_px: number, y_px: number): number | undefined {
    if (!this.#frame || !this.#bodies) return undefined;
    return pick(x_px, y_px, this.camera, this.#frame, this.#bodies);
  }

  hover(index: number | undefined): void {
    if (index === this.#hovered) return;
    this.#hovered = index;
    this.#focus();
    this.requestDraw();
  }

  /** Number of data blocks of a plan; null of other views. */
  get dataBlocks(): number | null {
    return this.#plan?.dataBlocks ?? null;
  }

  /** The image as shown, with its text and its legend, as PNG of twice the size. */
  snapshot(): Promise<Blob | null> {
    const canvas = this.compose(IMAGE_RATIO);
    return new Promise((then) => canvas.toBlob(then, "image/png"));
  }

  /** The image as shown, with its text and its legend, drawn now; `ratio` is the number of its pixels for each of the page. */
  compose(ratio = screenRatio()): HTMLCanvasElement {
    // The browser clears the drawing buffer once it has shown it.
    cancelAnimationFrame(this.#request);
    this.#drawAt(ratio);
    const canvas = this.#copy(ratio);
    if (ratio !== screenRatio()) this.#drawAt(screenRatio());
    return canvas;
  }

  #drawAt(ratio: number): void {
    if (ratio !== this.#renderer.getPixelRatio()) {
      this.#renderer.setPixelRatio(ratio);
      this.#overlay.resize(...this.#size, ratio);
      this.#viewChanged = true;
    }
    this.#draw();
  }

  /** What is on both canvases, and the legend. */
  #copy(ratio: number): HTMLCanvasElement {
    const { domElement: picture } = this.#renderer;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    const pen = canvas.getContext("2d")!;
    pen.drawImage(picture, 0, 0);
    pen.drawImage(this.#overlay.canvas, 0, 0, canvas.width, canvas.height);
    pen.scale(ratio, ratio);
    drawLegend(pen, this.#roles, this.#size[0], this.#palette);
    const [width_px, height_px] = this.#size;
    const place = { width_px, height_px: height_px - this.#profile_px, palette: this.#palette };
    drawColorLegend(pen, this.#colors?.legend ?? null, place);
    return canvas;
  }

  /** Returns the position of a body in the shown frame. */
  positionOf(index: number): Point3 | null {
    const frame = this.#frame;
    if (!frame) return null;
    const d = frame.dimensions;
    return [
      frame.positions_m[d * index]!,
      frame.positions_m[d * index + 1]!,
      d === 3 ? frame.positions_m[d * index + 2]! : 0,
    ];
  }

  dispose(): void {
    cancelAnimationFrame(this.#request);
    this.#floor?.dispose();
    this.#painter.dispose();
    this.#glass?.dispose();
    this.#dropColors();
    for (const strokes of [this.#grid, this.#trailStrokes, this.#marks]) strokes.quads.dispose();
    this.#dropAreas();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  #draw(): void {
    this.#request = 0;
    const pxPerM = 1 / this.camera.mPerPx;
    if (this.#frame) this.#drawBodies(this.#frame);
    if (this.#marksChanged) this.#drawMarks();
    if (this.#viewChanged) {
      const [width_px, height_px] = this.#size;
      const ratio = this.#renderer.getPixelRatio();
      this.#painter.scale({ pxPerM, palette: this.#palette, width_px, height_px, ratio });
      for (const strokes of [this.#grid, this.#trailStrokes, this.#marks]) strokes.scale(pxPerM, ...this.#size);
      if (this.#plan) this.#plan.drawGrid(this.#grid, this.#planState(this.#plan));
      else if (!this.#floor) drawGrid(this.#grid, this.camera, this.#extent, this.#size, this.#palette);
    }
    this.#bodiesChanged = this.#marksChanged = this.#viewChanged = false;
    this.#glass?.update(this.#renderer, this.camera.threeCamera);
    this.#renderer.render(this.#graph, this.camera.threeCamera);
    const words = this.#plan?.wordLayer(this.#planState(this.#plan)) ?? null;
    this.#overlay.draw(this.camera, this.#extent, this.#labels(), this.#palette, words);
    this.pictures++;
    this.onDrawn(this.#roles);
    for (const listener of this.drawListeners) listener();
  }

  #drawBodies(frame: Frame): void {
    const colors = this.#colors!;
    const { camera } = this;
    const size_px = this.#size;
    const isChanged = colors.update(frame, { camera, size_px, options: this.#options, palette: this.#palette });
    if (this.#floor) this.#floor.walls.visible = colors.isDense;
    if (isChanged || this.#bodiesChanged) {
      this.#painter.setColors?.(colors.tints, colors.isDense, this.#options.colors === "state");
      this.#painter.frame(frame);
    }
    const key = JSON.stringify([colors.legend, this.#palette.isDark]);
    if (key === this.#legend) return;
    this.#legend = key;
    this.onLegend(colors.legend);
  }

  /** The state of the view that the words of a plan depend on. */
  #planState(plan: PlanView): PlanState {
    const { selected, inspection } = this.#options;
    return {
      camera: this.camera as PlaneCamera,
      palette: this.#palette,
      size_px: this.#size,
      profile_px: this.#profile_px,
      selected: selected ? plan.painter.bodies?.find(selected) : undefined,
      hovered: this.#hovered,
      inspection: selected ? inspection : null,
      frame: this.#frame,
    };
  }

  #drawMarks(): void {
    const { inspection, selected } = this.#options;
    this.#drawTrails();
    this.#dropAreas();
    this.#marks.begin();
    const marks = selected && inspection ? inspection.marks : [];
    for (const mesh of fillAreas(marks, this.#palette)) this.#areas.add(mesh);
    // A plan draws marks at single places as rings, which cover no aircraft.
    const drawn = this.#plan ? marks.filter(({ shape }) => shape.type !== "point") : marks;
    const roles = drawMarks(drawn, this.#marks, this.#palette);
    for (const { role } of marks) roles.add(role);
    const scans = selected && this.#frame ? this.#frame.text.scans : [];
    for (const role of drawScans(scans, this.#marks, this.#palette)) roles.add(role);
    this.#drawLinks();
    this.#marks.end();
    this.#roles = roles;
  }

  /** Draws links; thin ones where all are shown, because there are many then. */
  #drawLinks(): void {
    const { links, selected } = this.#options;
    for (const { from, to, isMutual } of links) {
      const [a, b] = [this.positionOf(from), this.positionOf(to)];
      const color = visibleColor(ROLES[isMutual ? "done" : "refused"].color, this.#palette);
      if (a && b)
        this.#marks.piece(a, b, selected ? 2 : 1, 0, packColor(color, isMutual && !selected ? 0.55 : 0.9), !isMutual);
    }
  }

  #dropColors(): void {
    if (!this.#colors) return;
    this.#graph.remove(this.#colors.density.mesh);
    this.#colors.density.dispose();
  }

  #dropAreas(): void {
    for (const mesh of this.#areas.children as Mesh[]) {
      mesh.geometry.dispose();
      (mesh.material as { dispose(): void }).dispose();
    }
    this.#areas.clear();
  }

  #drawTrails(): void {
    const [bodies, trails] = [this.#bodies, this.#trails];
    this.#trailStrokes.begin();
    if (bodies && trails) {
      const { selected, widthIsTrue, trails: mode } = this.#options;
      const colorOf = (index: number) => this.#colors?.colorOf(index) ?? null;
      const style = { bodies, trails, palette: this.#palette, widthIsTrue, colorOf };
      for (const index of bodiesWithTrails(bodies, mode, selected)) drawTrail(this.#trailStrokes, index, style);
    }
    this.#trailStrokes.end();
  }

  #labels(): Label[] {
    const [bodies, frame] = [this.#bodies, this.#frame];
    if (!bodies || !frame) return [];
    const selected = this.#options.selected ? bodies.find(this.#options.selected) : undefined;
    const rings = new Map<number, Label["ring"]>();
    const { namedAgents: named } = bodies;
    // Data blocks have the names in a plan.
    if (!this.#plan && named.length <= MAX_LABELS) for (const [index] of named) rings.set(index, null);
    if (this.#hovered !== undefined) rings.set(this.#hovered, "hovered");
    if (selected !== undefined) rings.set(selected, "selected");
    return [...rings].flatMap(([index, ring]) => this.#label(bodies, index, ring));
  }

  #label(bodies: Bodies, index: number, ring: Label["ring"]): Label[] {
    const at = this.positionOf(index);
    if (!at) return [];
    const [x_px, y_px, inFront] = this.camera.project(...at);
    const radius_px = flatRadiusOf(bodies.table.shapes[bodies.table.shape[index]!]!) / this.camera.mPerPx;
    if (!inFront) return [];
    // In a plan, where symbols keep their size, the data block has the name.
    if (this.#plan) return [{ x_px, y_px, radius_px: SYMBOL_PX, words: "", ring }];
    return [{ x_px, y_px, radius_px, words: ring ? bodies.name(index) : bodies.wholeName(index), ring }];
  }
}
