/** The plan view of traffic: its painter, and the words over it, for a viewport. */

import type { Frame } from "../decode";
import type { Inspection, Scene } from "../protocol";
import type { WordLayer } from "./overlay";
import { PlanPainter } from "./plan";
import { drawGraticule, PlanWords, type WordsContext } from "./plan-words";
import type { Strokes } from "./strokes";
import type { Painter } from "./viewport";

/** The state of a viewport that the words depend on. */
export interface PlanState extends Omit<WordsContext, "scene" | "painter" | "marks"> {
  inspection: Inspection | null;
  frame: Frame | null;
}

export class PlanView {
  readonly painter: PlanPainter;
  readonly #scene: Scene;
  readonly #words: PlanWords;

  constructor(painter: PlanPainter, scene: Scene) {
    this.painter = painter;
    this.#scene = scene;
    this.#words = new PlanWords(scene);
  }

  /** Number of data blocks of the last picture. */
  get dataBlocks(): number {
    return this.#words.counts.drawn;
  }

  /** Has the next picture not depend on those before: it does not follow them. */
  forgetPlaces(): void {
    this.#words.forgetPlaces();
  }

  drawGrid(strokes: Strokes, state: PlanState): void {
    drawGraticule(strokes, this.#words.lines(this.#context(state)), state.palette);
  }

  wordLayer(state: PlanState): WordLayer {
    const { frame, selected, hovered, profile_px, inspection } = state;
    const inspected = [inspection?.cycle, inspection?.marks.length];
    const look = this.painter.look;
    const key = JSON.stringify([look, frame?.tableId, frame?.cycle, selected, hovered, profile_px, inspected]);
    const context = this.#context(state);
    return { key, draw: (pen) => this.#words.draw(pen, context) };
  }

  #context({ inspection, ...state }: PlanState): WordsContext {
    return { ...state, scene: this.#scene, painter: this.painter, marks: inspection?.marks ?? [] };
  }
}

/** The plan view of a painter; null for other painters. */
export function planOf(painter: Painter, scene: Scene): PlanView | null {
  return painter instanceof PlanPainter ? new PlanView(painter, scene) : null;
}
