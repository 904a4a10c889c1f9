/**
 * Many small quads in one draw call, with columns that say where and how each is drawn. They are not instanced: software
 * renderers treat each instance as a draw call of its own, which makes ten thousand of them ten times slower.
 */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Mesh, type RawShaderMaterial } from "three";
import type { Column } from "./instances";

/** Source for vertex shaders: the corner of the quad, from -0.5 to 0.5 each way. */
export const CORNER = `
vec2 corner() { return vec2(float(gl_VertexID & 1), float((gl_VertexID >> 1) & 1)) - 0.5; }
`;

type Numbers = Float32Array | Uint32Array;

export class Quads {
  readonly mesh: Mesh<BufferGeometry, RawShaderMaterial>;
  readonly #columns: Record<string, Column>;
  /** One entry for each quad; the attributes have four. */
  readonly #entries: Record<string, Numbers> = {};
  /** The entries last uploaded: most columns do not change from one frame to the next. */
  readonly #sent: Record<string, Numbers> = {};
  #capacity = 0;

  constructor(columns: Record<string, Column>, material: RawShaderMaterial) {
    this.#columns = columns;
    this.mesh = new Mesh(new BufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.reserve(16);
    this.commit(0);
  }

  /** Makes room; written entries stay. */
  reserve(count: number): void {
    if (count <= this.#capacity) return;
    this.#capacity = Math.max(count, 2 * this.#capacity);
    const geometry = this.mesh.geometry;
    // Resized buffers need new handles in the driver: dispose() releases the old ones.
    geometry.dispose();
    for (const [name, { size, bytes }] of Object.entries(this.#columns)) {
      const entries = bytes ? new Uint32Array(this.#capacity) : new Float32Array(size * this.#capacity);
      const before = this.#entries[name];
      if (before) entries.set(before);
      this.#entries[name] = entries;
      this.#sent[name] = entries.slice().fill(0);
      const corners = bytes ? new Uint8Array(16 * this.#capacity) : new Float32Array(4 * size * this.#capacity);
      geometry.setAttribute(name, new BufferAttribute(corners, size, bytes === true).setUsage(DynamicDrawUsage));
    }
    geometry.setIndex(new BufferAttribute(trianglesOf(this.#capacity), 1));
  }

  floats(name: string): Float32Array {
    return this.#entries[name] as Float32Array;
  }

  /** A column of four bytes as words. */
  words(name: string): Uint32Array {
    return this.#entries[name] as Uint32Array;
  }

  /** Draws the first `count` quads. */
  commit(count: number): void {
    const geometry = this.mesh.geometry;
    geometry.setDrawRange(0, 6 * count);
    this.mesh.visible = count > 0;
    if (count === 0) return;
    for (const [name, { size, bytes }] of Object.entries(this.#columns)) {
      const [entries, sent, numbers] = [this.#entries[name]!, this.#sent[name]!, count * (bytes ? 1 : size)];
      if (isSame(entries, sent, numbers)) continue;
      sent.set(entries.subarray(0, numbers));
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      const { array } = attribute;
      const corners = bytes ? new Uint32Array(array.buffer) : (array as Float32Array);
      repeatEntries(entries, corners, bytes ? 1 : size, count);
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, 4 * count * size);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

/** Two triangles for each quad, over corners 0 to 3. */
function trianglesOf(quads: number): Uint32Array {
  const index = new Uint32Array(6 * quads);
  for (let i = 0; i < quads; i++) index.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 2, 4 * i + 1, 4 * i + 3], 6 * i);
  return index;
}

function isSame(a: Numbers, b: Numbers, count: number): boolean {
  for (let i = 0; i < count; i++) if (a[i] !== b[i]) return false;
  return true;
}

/** Writes each entry four times. */
function repeatEntries(entries: Numbers, corners: Numbers, size: number, count: number): void {
  let to = 0;
  for (let i = 0; i < count; i++) {
    for (let corner = 0; corner < 4; corner++) {
      for (let k = 0; k < size; k++) corners[to++] = entries[i * size + k]!;
    }
  }
}
