/** Copies of one small geometry, with columns that say where and how each is drawn. */

import {
  BufferAttribute,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  type BufferGeometry,
  type RawShaderMaterial,
} from "three";

/** A column: numbers for each copy, or bytes that the shader sees as 0 to 1. */
export interface Column {
  size: 1 | 2 | 3 | 4;
  bytes?: boolean;
}

export class Instances {
  readonly mesh: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #columns: Record<string, Column>;
  #capacity = 0;

  constructor(shape: BufferGeometry, columns: Record<string, Column>, material: RawShaderMaterial) {
    const geometry = new InstancedBufferGeometry();
    geometry.index = shape.index;
    for (const [name, attribute] of Object.entries(shape.attributes)) {
      if (attribute instanceof BufferAttribute) geometry.setAttribute(name, attribute);
    }
    geometry.instanceCount = 0;
    this.#columns = columns;
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.reserve(16);
  }

  /** Makes room; written entries stay. */
  reserve(count: number): void {
    if (count <= this.#capacity) return;
    this.#capacity = Math.max(count, 2 * this.#capacity);
    const geometry = this.mesh.geometry;
    const drawn = geometry.instanceCount;
    const old = { ...geometry.attributes };
    // Resized buffers need new handles in the driver: dispose() releases the old ones.
    geometry.dispose();
    for (const [name, { size, bytes }] of Object.entries(this.#columns)) {
      const length = size * this.#capacity;
      const array = bytes ? new Uint8Array(length) : new Float32Array(length);
      const before = old[name];
      if (before) array.set(before.array as Float32Array);
      const attribute = new InstancedBufferAttribute(array, size, bytes === true);
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
    }
    geometry.instanceCount = drawn;
  }

  floats(name: string): Float32Array {
    return this.mesh.geometry.getAttribute(name).array as Float32Array;
  }

  /** A column of four bytes as words. */
  words(name: string): Uint32Array {
    const bytes = this.mesh.geometry.getAttribute(name).array as Uint8Array;
    return new Uint32Array(bytes.buffer, bytes.byteOffset, bytes.length >> 2);
  }

  /** Draws the first `count` copies; the named columns have changed. */
  commit(count: number, changed: string[] = Object.keys(this.#columns)): void {
    const geometry = this.mesh.geometry;
    geometry.instanceCount = count;
    this.mesh.visible = count > 0;
    for (const name of changed) {
      const attribute = geometry.getAttribute(name) as InstancedBufferAttribute;
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * attribute.itemSize);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
