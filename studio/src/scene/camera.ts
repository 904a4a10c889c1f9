/** Two cameras with one interface: straight down on the plane, and in orbit around a point in space. */

import { Matrix4, OrthographicCamera, PerspectiveCamera, Vector3, type Camera as ThreeCamera } from "three";
import type { Point3 } from "../protocol";

/** A box that holds a scene, in meters. */
export interface Extent {
  low: Point3;
  high: Point3;
}

export interface Camera {
  readonly threeCamera: ThreeCamera;
  resize(width_px: number, height_px: number): void;
  /** Width and height of the canvas, as of the last resize. */
  readonly size_px: readonly [number, number];
  fit(extent: Extent): void;
  pan(dx_px: number, dy_px: number): void;
  /** Zooms in by a factor; the position under this point of the canvas stays. */
  zoom(factor: number, x_px: number, y_px: number): void;
  rotate(dx_px: number, dy_px: number): void;
  /** Centers a position. */
  center(at: Point3): void;
  /** Takes place, scale and direction of another camera of the same kind. Returns whether it is of that kind. */
  take(other: Camera): boolean;
  /** Meters per pixel at the target point. */
  readonly mPerPx: number;
  /** The target point. */
  readonly middle: Point3;
  /** The position under a point of the canvas; in space, at the same depth as a reference position. */
  unproject(x_px: number, y_px: number, as: Point3): Point3;
  /** Returns x and y in pixels of a position, and whether it is in front of the camera. */
  project(x: number, y: number, z: number): [number, number, boolean];
}

/** Above and below all that a scene has, of which nothing is clipped: aircraft fly at ten thousand meters. */
const EYE_HEIGHT_M = 1e6;

export class PlaneCamera implements Camera {
  readonly threeCamera = new OrthographicCamera(-1, 1, 1, -1, 0, 2 * EYE_HEIGHT_M);
  mPerPx = 0.05;
  /** Height of a part at the lower edge that is covered by something else: the scene is fitted above it. */
  covered_px = 0;
  x = 0;
  y = 0;
  #width = 1;
  #height = 1;

  constructor() {
    this.threeCamera.position.z = EYE_HEIGHT_M;
  }

  get size_px(): readonly [number, number] {
    return [this.#width, this.#height];
  }

  resize(width_px: number, height_px: number): void {
    this.#width = Math.max(1, width_px);
    this.#height = Math.max(1, height_px);
    this.#update();
  }

  fit({ low: lo, high: hi }: Extent): void {
    this.x = (lo[0] + hi[0]) / 2;
    this.y = (lo[1] + hi[1]) / 2;
    const wide = (hi[0] - lo[0]) / Math.max(40, this.#width - 90);
    const high = (hi[1] - lo[1]) / Math.max(40, this.#height - this.covered_px - 70);
    this.mPerPx = Math.max(wide, high, 1e-5);
    this.y -= 0.5 * this.covered_px * this.mPerPx;
    this.#update();
  }

  pan(dx_px: number, dy_px: number): void {
    this.x -= dx_px * this.mPerPx;
    this.y += dy_px * this.mPerPx;
    this.#update();
  }

  zoom(factor: number, x_px: number, y_px: number): void {
    const [x, y] = this.at(x_px, y_px);
    this.mPerPx = Math.min(1e4, Math.max(1e-5, this.mPerPx / factor));
    const [x1, y1] = this.at(x_px, y_px);
    this.x += x - x1;
    this.y += y - y1;
    this.#update();
  }

  rotate(dx_px: number, dy_px: number): void {
    this.pan(dx_px, dy_px);
  }

  center([x, y]: Point3): void {
    this.x = x;
    this.y = y;
    this.#update();
  }

  take(other: Camera): boolean {
    if (!(other instanceof PlaneCamera)) return false;
    this.x = other.x;
    this.y = other.y;
    this.mPerPx = other.mPerPx;
    this.#update();
    return true;
  }

  /** The position under a point of the canvas. */
  at(x_px: number, y_px: number): [number, number] {
    return [this.x + (x_px - this.#width / 2) * this.mPerPx, this.y - (y_px - this.#height / 2) * this.mPerPx];
  }

  get middle(): Point3 {
    return [this.x, this.y, 0];
  }

  unproject(x_px: number, y_px: number): Point3 {
    return [...this.at(x_px, y_px), 0];
  }

  project(x: number, y: number): [number, number, boolean] {
    const px = this.#width / 2 + (x - this.x) / this.mPerPx;
    return [px, this.#height / 2 - (y - this.y) / this.mPerPx, true];
  }

  #update(): void {
    const [halfW, halfH] = [(this.#width / 2) * this.mPerPx, (this.#height / 2) * this.mPerPx];
    const camera = this.threeCamera;
    [camera.left, camera.right, camera.top, camera.bottom] = [-halfW, halfW, halfH, -halfH];
    camera.position.set(this.x, this.y, EYE_HEIGHT_M);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }
}

const FIELD_OF_VIEW_DEG = 40;

export class SpaceCamera implements Camera {
  readonly threeCamera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.1, 1000);
  readonly target = new Vector3();
  #distance = 10;
  #azimuth = -0.9;
  #elevation = 0.5;
  #width = 1;
  #height = 1;
  readonly #toClip = new Matrix4();
  readonly #point = new Vector3();

  constructor() {
    this.threeCamera.up.set(0, 0, 1);
  }

  get mPerPx(): number {
    return (2 * this.#distance * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360)) / this.#height;
  }

  get size_px(): readonly [number, number] {
    return [this.#width, this.#height];
  }

  resize(width_px: number, height_px: number): void {
    this.#width = Math.max(1, width_px);
    this.#height = Math.max(1, height_px);
    this.threeCamera.aspect = this.#width / this.#height;
    this.#update();
  }

  fit({ low: lo, high: hi }: Extent): void {
    this.target.set((lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (lo[2] + hi[2]) / 2);
    const radius = 0.5 * Math.hypot(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]);
    const narrow = Math.min(1, this.threeCamera.aspect);
    // Margin for the axis labels, which lie outside the box.
    this.#distance = Math.max(1e-4, (1.1 * radius) / Math.sin((FIELD_OF_VIEW_DEG * Math.PI) / 360) / narrow);
    this.#update();
  }

  pan(dx_px: number, dy_px: number): void {
    const side = new Vector3().setFromMatrixColumn(this.threeCamera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(this.threeCamera.matrixWorld, 1);
    this.target.addScaledVector(side, -dx_px * this.mPerPx).addScaledVector(up, dy_px * this.mPerPx);
    this.#update();
  }

  zoom(factor: number): void {
    this.#distance = Math.min(1e7, Math.max(1e-4, this.#distance / factor));
    this.#update();
  }

  rotate(dx_px: number, dy_px: number): void {
    this.#azimuth -= dx_px * 0.008;
    this.#elevation = Math.min(1.55, Math.max(-1.55, this.#elevation + dy_px * 0.008));
    this.#update();
  }

  center(at: Point3): void {
    this.target.set(...at);
    this.#update();
  }

  take(other: Camera): boolean {
    if (!(other instanceof SpaceCamera)) return false;
    this.target.copy(other.target);
    this.#distance = other.#distance;
    this.#azimuth = other.#azimuth;
    this.#elevation = other.#elevation;
    this.#update();
    return true;
  }

  get middle(): Point3 {
    return this.target.toArray();
  }

  unproject(x_px: number, y_px: number, as: Point3): Point3 {
    const from = this.threeCamera.position;
    const ray = new Vector3((2 * x_px) / this.#width - 1, 1 - (2 * y_px) / this.#height, 0.5)
      .unproject(this.threeCamera)
      .sub(from);
    const ahead = this.threeCamera.getWorldDirection(new Vector3());
    const far = ahead.dot(new Vector3(...as).sub(from)) / ahead.dot(ray);
    return ray.multiplyScalar(far).add(from).toArray();
  }

  project(x: number, y: number, z: number): [number, number, boolean] {
    const p = this.#point.set(x, y, z).applyMatrix4(this.#toClip);
    return [(0.5 + 0.5 * p.x) * this.#width, (0.5 - 0.5 * p.y) * this.#height, p.z > -1 && p.z < 1];
  }

  #update(): void {
    const camera = this.threeCamera;
    const flat = Math.cos(this.#elevation) * this.#distance;
    camera.position.set(
      this.target.x + flat * Math.cos(this.#azimuth),
      this.target.y + flat * Math.sin(this.#azimuth),
      this.target.z + Math.sin(this.#elevation) * this.#distance,
    );
    camera.near = this.#distance / 100;
    camera.far = this.#distance * 100;
    camera.lookAt(this.target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.#toClip.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  }
}
