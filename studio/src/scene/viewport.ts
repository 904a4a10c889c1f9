/** The canvas of one session: draws only when a frame, the camera or an option changes. */

import { Color, Group, Scene as Graph, SRGBColorSpace, WebGLRenderer, type Mesh } from "three";
import type { Frame } from "../decode";
import type { Inspection, Point3, MarkRole, Scene, BodyId } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { Link } from "../fleet/links";
import type { TrailMode } from "../state/display.svelte";
import { PlaneCamera, SpaceCamera, type Extent, type Camera } from "./camera";
import { BodyColors, type ColorOptions } from "./body-colors";
import type { ColorLegend } from "./coloring";
import { extentOf, flatRadiusOf } from "./extent";
import { FloorLayer } from "./floor";
import { drawGrid } from "./grid";
import { drawLegend } from "./legend";
import { drawMarks, drawScans, fillAreas } from "./marks";
import { Overlay, type Label } from "./overlay";
import { paletteOf, ROLES, visibleColor, packColor, type Palette } from "./palette";
import { pick } from "./pick";
import { PlanePainter } from "./plane";
import { SpacePainter } from "./space";
import { Strokes } from "./strokes";
import { Trails } from "./trails";

/** Draws the bodies of one kind of world. */
export interface Painter {
  readonly group: Group;
  paint(palette: Palette): void;
  setBodies(bodies: Bodies, palette: Palette): void;
  frame(frame: Frame): void;
  /** Sets colors for bodies instead of their own, none for those with 0, and whether agents are left out. */
  setColors?(tints: Uint32Array | null, hidesAgents: boolean): void;
  scale(pxPerM: number, palette: Palette, height_px: number): void;
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
function createLayers(scene: Scene): [Painter, FloorLayer | null] {
  const painter = scene.dimensions === 2 ? new PlanePainter(scene) : new SpacePainter(scene);
  return [painter, scene.floor ? new FloorLayer(scene.floor) : null];
}

/** Returns whether a camera of one scene fits another. */
function hasSameExtent(a: Scene, b: Scene): boolean {
  const measure = ({ world, floor }: Scene): string =>
    JSON.stringify([world, floor?.width, floor?.height, floor?.box_m, floor?.origin_m]);
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
  /** Number of draws so far. */
  pictures = 0;
  readonly #renderer: WebGLRenderer;
  readonly #overlay: Overlay;
  readonly #graph = new Graph();
  readonly #areas = new Group();
  #painter: Painter;
  #floor: FloorLayer | null;
  readonly #grid = new Strokes(1);
  readonly #trailStrokes = new Strokes(4);
  readonly #marks = new Strokes(8);
  #scene: Scene;
  #palette: Palette;
  #bodies: Bodies | null = null;
  #frame: Frame | null = null;
  #trails: Trails | null = null;
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

  constructor(canvas: HTMLCanvasElement, overlay: HTMLCanvasElement, scene: Scene, isDark: boolean, camera?: Camera) {
    this.#renderer = createRenderer(canvas, scene.dimensions === 3);
    this.#renderer.setPixelRatio(screenRatio());
    this.#overlay = new Overlay(overlay);
    this.#scene = scene;
    this.#palette = paletteOf(isDark);
    const isPlane = scene.dimensions === 2;
    this.#isFitted = camera !== undefined && camera instanceof PlaneCamera === isPlane;
    this.camera = this.#isFitted ? camera! : isPlane ? new PlaneCamera() : new SpaceCamera();
    [this.#painter, this.#floor] = createLayers(scene);
    if (this.#floor) this.#graph.add(this.#floor.mesh, this.#floor.walls);
    for (const strokes of [this.#grid, this.#trailStrokes, this.#marks]) this.#graph.add(strokes.quads.mesh);
    this.#graph.add(this.#painter.group, this.#areas);
    this.#extent = extentOf(scene, null, null);
    this.setTheme(isDark);
  }

  setTheme(isDark: boolean): void {
    this.#palette = paletteOf(isDark);
    this.#floor?.paint(this.#palette);
    this.#painter.paint(this.#palette);
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
    [this.#painter, this.#floor] = createLayers(scene);
    this.#graph.add(this.#painter.group);
    if (this.#floor) this.#graph.add(this.#floor.mesh, this.#floor.walls);
    if (this.#bodies) this.#painter.setBodies(this.#bodies, this.#palette);
    this.#extent = extentOf(scene, null, null);
    this.setTheme(this.#palette.isDark);
  }

  resize(width_px: number, height_px: number): void {
    if (width_px < 2 || height_px < 2) return;
    this.#size = [width_px, height_px];
    this.#renderer.setSize(width_px, height_px, false);
    this.#overlay.resize(width_px, height_px, screenRatio());
    this.camera.resize(width_px, height_px);
    if (!this.#isFitted || this.#isWhole) this.camera.fit(this.#extent);
    this.requestDraw();
  }

  setBodies(bodies: Bodies): void {
    this.#bodies = bodies;
    const dimensions = this.#scene.dimensions === 2 ? 2 : 3;
    this.#trails = new Trails(bodies.count, dimensions);
    this.#dropColors();
    this.#colors = new BodyColors(bodies, this.#scene);
    this.#graph.add(this.#colors.density.mesh);
    this.#painter.setBodies(bodies, this.#palette);
    this.#frame = null;
  }

  /** Shows a frame; after a seek it need not follow the previous one. */
  frame(frame: Frame, isSought = false): void {
    if (frame === this.#frame || !this.#bodies) return;
    const isFirst = this.#frame === null;
    this.#frame = frame;
    this.#trails?.push(frame.cycle, frame.positions_m, isSought);
    this.#colors?.push(frame, isSought);
    if (isFirst) this.#extent = extentOf(this.#scene, this.#bodies, frame);
    if (isFirst && !this.#isFitted) this.fit();
    this.#follow();
    this.#bodiesChanged = this.#marksChanged = true;
    this.requestDraw();
  }

  setOptions(options: ViewOptions): void {
    this.#options = options;
    this.#marksChanged = true;
    this.#follow();
    this.requestDraw();
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
    if (other.#scene.world !== this.#scene.world || !this.camera.take(other.camera)) return;
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
    this.requestDraw();
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
      this.#painter.scale(pxPerM, this.#palette, this.#size[1]);
      for (const strokes of [this.#grid, this.#trailStrokes, this.#marks]) strokes.scale(pxPerM, ...this.#size);
      if (!this.#floor) drawGrid(this.#grid, this.camera, this.#extent, this.#size, this.#palette);
    }
    this.#bodiesChanged = this.#marksChanged = this.#viewChanged = false;
    this.#renderer.render(this.#graph, this.camera.threeCamera);
    this.#overlay.draw(this.camera, this.#extent, this.#labels(), this.#palette);
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
      this.#painter.setColors?.(colors.tints, colors.isDense);
      this.#painter.frame(frame);
    }
    const key = JSON.stringify([colors.legend, this.#palette.isDark]);
    if (key === this.#legend) return;
    this.#legend = key;
    this.onLegend(colors.legend);
  }

  #drawMarks(): void {
    const { inspection, selected } = this.#options;
    this.#drawTrails();
    this.#dropAreas();
    this.#marks.begin();
    const marks = selected && inspection ? inspection.marks : [];
    for (const mesh of fillAreas(marks, this.#palette)) this.#areas.add(mesh);
    const roles = drawMarks(marks, this.#marks, this.#palette);
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
    if (bodies && trails) for (const index of this.#bodiesWithTrails(bodies)) this.#drawTrail(bodies, trails, index);
    this.#trailStrokes.end();
  }

  #bodiesWithTrails(bodies: Bodies): Iterable<number> {
    if (this.#options.trails === "all") return bodies.agents;
    const index = this.#options.selected ? bodies.find(this.#options.selected) : undefined;
    return this.#options.trails === "selected" && index !== undefined ? [index] : [];
  }

  /** A trail fades toward its old end. */
  #drawTrail(bodies: Bodies, trails: Trails, index: number): void {
    const { table } = bodies;
    const points = trails.points(index);
    const own = table.appearances[table.appearance[index]!]![0].color;
    const color = visibleColor(this.#colors?.colorOf(index) ?? own, this.#palette);
    const width_m = this.#options.widthIsTrue ? 2 * flatRadiusOf(table.shapes[table.shape[index]!]!) : 0;
    const maxAlpha = this.#options.widthIsTrue ? 0.35 : 0.85;
    for (let i = 1; i < points.length; i++) {
      this.#trailStrokes.piece(
        points[i - 1]!,
        points[i]!,
        1.5,
        width_m,
        packColor(color, maxAlpha * (0.12 + (0.88 * i) / points.length)),
      );
    }
  }

  #labels(): Label[] {
    const [bodies, frame] = [this.#bodies, this.#frame];
    if (!bodies || !frame) return [];
    const selected = this.#options.selected ? bodies.find(this.#options.selected) : undefined;
    const rings = new Map<number, Label["ring"]>();
    const { namedAgents: named } = bodies;
    if (named.length <= MAX_LABELS) for (const [index] of named) rings.set(index, null);
    if (this.#hovered !== undefined) rings.set(this.#hovered, "hovered");
    if (selected !== undefined) rings.set(selected, "selected");
    return [...rings].flatMap(([index, ring]) => this.#label(bodies, index, ring));
  }

  #label(bodies: Bodies, index: number, ring: Label["ring"]): Label[] {
    const at = this.positionOf(index);
    if (!at) return [];
    const [x_px, y_px, inFront] = this.camera.project(...at);
    const radius_px = flatRadiusOf(bodies.table.shapes[bodies.table.shape[index]!]!) / this.camera.mPerPx;
    return inFront ? [{ x_px, y_px, radius_px, words: ring ? bodies.name(index) : bodies.wholeName(index), ring }] : [];
  }
}
