/** The canvas of one session: draws when a frame, the camera or a choice changes, and not otherwise. */

import { Color, Group, Scene as Graph, SRGBColorSpace, WebGLRenderer, type Mesh } from "three";
import type { Frame } from "../decode";
import type { Inspection, Place, Role, Scene, Who } from "../protocol";
import type { Bodies } from "../state/cast";
import type { Link } from "../fleet/links";
import type { TrailChoice } from "../state/session.svelte";
import { PlaneEye, SpaceEye, type Extent, type Eye } from "./camera";
import { extentOf, flatRadiusOf } from "./extent";
import { FloorLayer } from "./floor";
import { drawGrid } from "./grid";
import { drawMarks, drawScans, fillAreas } from "./marks";
import { Overlay, type Label } from "./overlay";
import { paletteOf, ROLES, visible, word, type Palette } from "./palette";
import { pick } from "./pick";
import { PlanePainter } from "./plane";
import { SpacePainter } from "./space";
import { Strokes } from "./strokes";
import { Trails } from "./trails";

/** Draws the bodies of one kind of world. */
export interface Painter {
  readonly group: Group;
  paint(palette: Palette): void;
  cast(bodies: Bodies, palette: Palette): void;
  frame(frame: Frame): void;
  scale(pxPerM: number, palette: Palette, height_px: number): void;
  dispose(): void;
}

/** Choices of the page: the things that it shows. */
export interface Choices {
  selected: Who | null;
  inspection: Inspection | null;
  trails: TrailChoice;
  widthIsTrue: boolean;
  /** Pairs that hear each other in a fleet, by the bodies' indices. */
  links: readonly Link[];
}

/** Bodies with names of their own are labeled if there are not more. */
const MOST_NAMES = 40;

/** A renderer with no more than it needs: an opaque, flat canvas is cheap to put on the screen. */
function rendererOf(canvas: HTMLCanvasElement, isSpace: boolean): WebGLRenderer {
  const wanted = {
    alpha: false,
    antialias: isSpace,
    depth: isSpace,
    stencil: false,
    powerPreference: "high-performance",
  } as const;
  const context = canvas.getContext("webgl2", wanted) as WebGL2RenderingContext | null;
  if (!context) throw new Error("no WebGL 2");
  return new WebGLRenderer({ canvas, context, ...wanted });
}

/** Returns the painter of a scene's bodies, and its floor. */
function layersOf(scene: Scene): [Painter, FloorLayer | null] {
  const painter = scene.dimensions === 2 ? new PlanePainter(scene) : new SpacePainter(scene);
  return [painter, scene.floor ? new FloorLayer(scene.floor) : null];
}

/** Returns whether two scenes can be looked at from the same place. */
function isAlike(a: Scene, b: Scene): boolean {
  const measure = ({ world, floor }: Scene): string =>
    JSON.stringify([world, floor?.width, floor?.height, floor?.box_m, floor?.origin_m]);
  return measure(a) === measure(b);
}

export class Stage {
  readonly eye: Eye;
  /** Called after each picture, with the roles of marks that it shows. */
  onDrawn: (roles: ReadonlySet<Role>) => void = () => undefined;
  /** Called after each picture too: drawings over it follow the camera. */
  readonly followers = new Set<() => void>();
  /** Pictures drawn so far. */
  pictures = 0;
  readonly #renderer: WebGLRenderer;
  readonly #overlay: Overlay;
  readonly #graph = new Graph();
  readonly #areas = new Group();
  #painter: Painter;
  #floor: FloorLayer | null;
  readonly #grid = new Strokes(1);
  readonly #ways = new Strokes(4);
  readonly #marks = new Strokes(8);
  #scene: Scene;
  #palette: Palette;
  #bodies: Bodies | null = null;
  #frame: Frame | null = null;
  #trails: Trails | null = null;
  #choices: Choices = { selected: null, inspection: null, trails: "none", widthIsTrue: false, links: [] };
  #hovered: number | undefined;
  #extent: Extent;
  #size: [number, number] = [1, 1];
  #isFitted = false;
  /** Whether everything is in sight because the camera was not moved: then it stays so in another size. */
  #isWhole = false;
  #request = 0;
  #bodiesChanged = true;
  #marksChanged = true;
  #viewChanged = true;
  #roles: ReadonlySet<Role> = new Set();

  constructor(canvas: HTMLCanvasElement, overlay: HTMLCanvasElement, scene: Scene, isDark: boolean, eye?: Eye) {
    this.#renderer = rendererOf(canvas, scene.dimensions === 3);
    this.#renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.#overlay = new Overlay(overlay);
    this.#scene = scene;
    this.#palette = paletteOf(isDark);
    const isPlane = scene.dimensions === 2;
    this.#isFitted = eye !== undefined && eye instanceof PlaneEye === isPlane;
    this.eye = this.#isFitted ? eye! : isPlane ? new PlaneEye() : new SpaceEye();
    [this.#painter, this.#floor] = layersOf(scene);
    if (this.#floor) this.#graph.add(this.#floor.mesh);
    for (const strokes of [this.#grid, this.#ways, this.#marks]) this.#graph.add(strokes.quads.mesh);
    this.#graph.add(this.#painter.group, this.#areas);
    this.#extent = extentOf(scene, null, null);
    this.theme(isDark);
  }

  theme(isDark: boolean): void {
    this.#palette = paletteOf(isDark);
    this.#floor?.paint(this.#palette);
    this.#painter.paint(this.#palette);
    const back = this.#floor ? this.#palette.background : this.#palette.free;
    this.#renderer.setClearColor(new Color().setRGB(back[0] / 255, back[1] / 255, back[2] / 255, SRGBColorSpace));
    this.#bodiesChanged = this.#marksChanged = true;
    this.changed();
  }

  /** Shows another scene of as many dimensions, as after an edit; the old picture stays until its first frame. */
  restage(scene: Scene): void {
    if (scene === this.#scene) return;
    if (!isAlike(scene, this.#scene)) this.#isFitted = false;
    this.#scene = scene;
    this.#painter.dispose();
    this.#floor?.dispose();
    this.#graph.remove(this.#painter.group);
    if (this.#floor) this.#graph.remove(this.#floor.mesh);
    [this.#painter, this.#floor] = layersOf(scene);
    this.#graph.add(this.#painter.group);
    if (this.#floor) this.#graph.add(this.#floor.mesh);
    if (this.#bodies) this.#painter.cast(this.#bodies, this.#palette);
    this.#extent = extentOf(scene, null, null);
    this.theme(this.#palette.isDark);
  }

  resize(width_px: number, height_px: number): void {
    if (width_px < 2 || height_px < 2) return;
    this.#size = [width_px, height_px];
    this.#renderer.setSize(width_px, height_px, false);
    this.#overlay.resize(width_px, height_px, Math.min(2, window.devicePixelRatio));
    this.eye.resize(width_px, height_px);
    if (!this.#isFitted || this.#isWhole) this.eye.fit(this.#extent);
    this.changed();
  }

  cast(bodies: Bodies): void {
    this.#bodies = bodies;
    this.#trails = new Trails(bodies.count, this.#scene.dimensions === 2 ? 2 : 3);
    this.#painter.cast(bodies, this.#palette);
    this.#frame = null;
  }

  /** Takes a frame; one that was sought need not follow the one before. */
  frame(frame: Frame, isSought = false): void {
    if (frame === this.#frame || !this.#bodies) return;
    const isFirst = this.#frame === null;
    this.#frame = frame;
    this.#trails?.push(frame.cycle, frame.places_m, isSought);
    if (isFirst) this.#extent = extentOf(this.#scene, this.#bodies, frame);
    if (isFirst && !this.#isFitted) this.fit();
    this.#bodiesChanged = this.#marksChanged = true;
    this.changed();
  }

  choose(choices: Choices): void {
    this.#choices = choices;
    this.#marksChanged = true;
    this.changed();
  }

  /** Shows everything. */
  fit(): void {
    if (this.#frame) this.#extent = extentOf(this.#scene, this.#bodies, this.#frame);
    this.eye.fit(this.#extent);
    this.#isFitted = this.#isWhole = this.#frame !== null && this.#size[0] > 1;
    this.changed();
  }

  /** Brings the middle of the view nearer by a factor. */
  zoom(factor: number): void {
    this.eye.zoom(factor, this.#size[0] / 2, this.#size[1] / 2);
    this.moved();
  }

  /** Brings a body to the middle. */
  center(index: number): void {
    const at = this.placeOf(index);
    if (!at) return;
    this.eye.center(at);
    this.moved();
  }

  /** Brings a body into sight, if it is not. */
  show(index: number): void {
    const at = this.placeOf(index);
    if (!at) return;
    const [x, y, inFront] = this.eye.project(...at);
    const isSeen = inFront && x > 0 && y > 0 && x < this.#size[0] && y < this.#size[1];
    if (!isSeen) this.center(index);
  }

  /** Notes that the user has moved the camera. */
  moved(): void {
    this.#isWhole = false;
    this.changed();
  }

  /** Returns whether the camera stands where the user has put it. */
  get isMoved(): boolean {
    return this.#isFitted && !this.#isWhole;
  }

  /** Notes that something in sight has changed. */
  changed(): void {
    this.#viewChanged = true;
    if (this.#request === 0) this.#request = requestAnimationFrame(() => this.#draw());
  }

  agentAt(x_px: number, y_px: number): number | undefined {
    if (!this.#frame || !this.#bodies) return undefined;
    return pick(x_px, y_px, this.eye, this.#frame, this.#bodies);
  }

  hover(index: number | undefined): void {
    if (index === this.#hovered) return;
    this.#hovered = index;
    this.changed();
  }

  /** The picture as it is seen, with its words. */
  snapshot(): Promise<Blob | null> {
    // The drawing buffer is gone once the browser has shown it.
    cancelAnimationFrame(this.#request);
    this.#draw();
    const { domElement: picture } = this.#renderer;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    const pen = canvas.getContext("2d")!;
    pen.drawImage(picture, 0, 0);
    pen.drawImage(this.#overlay.canvas, 0, 0, canvas.width, canvas.height);
    return new Promise((then) => canvas.toBlob(then, "image/png"));
  }

  /** Returns the place where a body appears, for tests and for keeping it in sight. */
  placeOf(index: number): Place | null {
    const frame = this.#frame;
    if (!frame) return null;
    const d = frame.dimensions;
    return [frame.places_m[d * index]!, frame.places_m[d * index + 1]!, d === 3 ? frame.places_m[d * index + 2]! : 0];
  }

  dispose(): void {
    cancelAnimationFrame(this.#request);
    this.#floor?.dispose();
    this.#painter.dispose();
    for (const strokes of [this.#grid, this.#ways, this.#marks]) strokes.quads.dispose();
    this.#dropAreas();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  #draw(): void {
    this.#request = 0;
    const pxPerM = 1 / this.eye.mPerPx;
    if (this.#bodiesChanged && this.#frame) this.#painter.frame(this.#frame);
    if (this.#marksChanged) this.#drawMarks();
    if (this.#viewChanged) {
      this.#painter.scale(pxPerM, this.#palette, this.#size[1]);
      for (const strokes of [this.#grid, this.#ways, this.#marks]) strokes.scale(pxPerM, ...this.#size);
      if (!this.#floor) drawGrid(this.#grid, this.eye, this.#extent, this.#size, this.#palette);
    }
    this.#bodiesChanged = this.#marksChanged = this.#viewChanged = false;
    this.#renderer.render(this.#graph, this.eye.camera);
    this.#overlay.draw(this.eye, this.#extent, this.#labels(), this.#palette);
    this.pictures++;
    this.onDrawn(this.#roles);
    for (const tell of this.followers) tell();
  }

  #drawMarks(): void {
    const { inspection, selected } = this.#choices;
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

  /** Thin where all links are drawn, because there are many then. */
  #drawLinks(): void {
    const { links, selected } = this.#choices;
    for (const { from, to, isMutual } of links) {
      const [a, b] = [this.placeOf(from), this.placeOf(to)];
      const color = visible(ROLES[isMutual ? "done" : "refused"].color, this.#palette);
      if (a && b)
        this.#marks.piece(a, b, selected ? 2 : 1, 0, word(color, isMutual && !selected ? 0.55 : 0.9), !isMutual);
    }
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
    this.#ways.begin();
    if (bodies && trails) for (const index of this.#trailed(bodies)) this.#drawTrail(bodies, trails, index);
    this.#ways.end();
  }

  #trailed(bodies: Bodies): Iterable<number> {
    if (this.#choices.trails === "all") return bodies.agents;
    const index = this.#choices.selected ? bodies.find(this.#choices.selected) : undefined;
    return this.#choices.trails === "selected" && index !== undefined ? [index] : [];
  }

  /** A trail fades toward its old end. */
  #drawTrail(bodies: Bodies, trails: Trails, index: number): void {
    const { cast } = bodies;
    const way = trails.of(index);
    const color = visible(cast.looks[cast.look[index]!]![0].color, this.#palette);
    const width_m = this.#choices.widthIsTrue ? 2 * flatRadiusOf(cast.shapes[cast.shape[index]!]!) : 0;
    const most = this.#choices.widthIsTrue ? 0.35 : 0.85;
    for (let i = 1; i < way.length; i++) {
      this.#ways.piece(way[i - 1]!, way[i]!, 1.5, width_m, word(color, most * (0.12 + (0.88 * i) / way.length)));
    }
  }

  #labels(): Label[] {
    const [bodies, frame] = [this.#bodies, this.#frame];
    if (!bodies || !frame) return [];
    const selected = this.#choices.selected ? bodies.find(this.#choices.selected) : undefined;
    const wanted = new Map<number, Label["ring"]>();
    const { named } = bodies;
    if (named.length <= MOST_NAMES) for (const [index] of named) wanted.set(index, null);
    if (this.#hovered !== undefined) wanted.set(this.#hovered, "hovered");
    if (selected !== undefined) wanted.set(selected, "selected");
    return [...wanted].flatMap(([index, ring]) => this.#label(bodies, index, ring));
  }

  #label(bodies: Bodies, index: number, ring: Label["ring"]): Label[] {
    const at = this.placeOf(index);
    if (!at) return [];
    const [x_px, y_px, inFront] = this.eye.project(...at);
    const radius_px = flatRadiusOf(bodies.cast.shapes[bodies.cast.shape[index]!]!) / this.eye.mPerPx;
    return inFront ? [{ x_px, y_px, radius_px, words: ring ? bodies.name(index) : bodies.whole(index), ring }] : [];
  }
}
