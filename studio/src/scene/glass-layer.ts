/**
 * Glass bodies at rest, drawn once for each view. Thousands of them take most of the time of a picture, and while only
 * agents move none of them changes. They lie behind everything else, so that agents among them stay visible.
 */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  Mesh,
  Scene as Graph,
  Vector2,
  WebGLRenderTarget,
  type Camera,
  type RawShaderMaterial,
  type WebGLRenderer,
} from "three";
import { material } from "./material";

/** Samples of each pixel: edges are as smooth as those of other bodies. */
const SAMPLES = 4;

/** A triangle that covers the picture, at the far end of what is seen: bodies cover it. */
const VERTEX = `
void main() {
  vec2 at = vec2(float((gl_VertexID << 1) & 2), float(gl_VertexID & 2));
  gl_Position = vec4(2.0 * at - 1.0, 1.0, 1.0);
}`;
const FRAGMENT = `
uniform highp sampler2D image;
void main() { color = texelFetch(image, ivec2(gl_FragCoord.xy), 0); }`;

export class GlassLayer {
  /** What shows the image of the bodies. */
  readonly mesh: Mesh;
  readonly #look: RawShaderMaterial;
  readonly #bodies = new Graph();
  readonly #target = new WebGLRenderTarget(1, 1, { samples: SAMPLES, depthBuffer: false });
  /** The view of the present image. */
  #view: number[] = [];

  constructor(bodies: Group) {
    this.#bodies.add(bodies);
    const uniforms = { image: { value: this.#target.texture } };
    const look = (this.#look = material({
      vertex: VERTEX,
      fragment: FRAGMENT,
      uniforms,
      depth: true,
      transparent: true,
    }));
    // The image of things that shine through each other has their colors multiplied already.
    look.premultipliedAlpha = true;
    const triangle = new BufferGeometry();
    // Shaders count the corners themselves; three wants to know how many there are.
    triangle.setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
    this.mesh = new Mesh(triangle, look);
    this.mesh.frustumCulled = false;
  }

  /** The bodies have other colors: the next image is drawn anew. */
  invalidate(): void {
    this.#view = [];
  }

  /** Draws the bodies, where the view is another one than that of the present image. */
  update(renderer: WebGLRenderer, camera: Camera): void {
    const { x, y } = renderer.getDrawingBufferSize(new Vector2());
    camera.updateMatrixWorld();
    const view = [x, y, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements];
    if (view.every((value, i) => value === this.#view[i])) return;
    this.#view = view;
    this.#target.setSize(x, y);
    const ground = renderer.getClearColor(new Color());
    renderer.setClearColor(0, 0);
    renderer.setRenderTarget(this.#target);
    renderer.render(this.#bodies, camera);
    renderer.setRenderTarget(null);
    renderer.setClearColor(ground, 1);
  }

  dispose(): void {
    this.#look.dispose();
    this.#target.dispose();
    this.mesh.geometry.dispose();
  }
}
