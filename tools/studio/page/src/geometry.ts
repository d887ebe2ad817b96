// Where the panes are and which point of a slice lies under which pixel.
import type { Point } from './protocol';
import type { LoadedVolume } from './volume';

export type SliceName = 'axial' | 'coronal' | 'sagittal';
export interface Rectangle { left: number; top: number; width: number; height: number }  // CSS pixels

/** h and v: the volume's axes (RAS order) to the right and upwards; normal: the one through the slice. */
export const SLICES: Record<SliceName, { h: number; v: number; normal: number; type: number; title: string }> = {
  axial: { h: 0, v: 1, normal: 2, type: 0, title: 'Axial' },
  coronal: { h: 0, v: 2, normal: 1, type: 1, title: 'Coronal' },
  sagittal: { h: 1, v: 2, normal: 0, type: 2, title: 'Sagittal' },
};
export const SLICE_NAMES = Object.keys(SLICES) as SliceName[];

export interface Camera { centre: Point; zoom: number }  // ortho mm

export class SliceView {
  readonly h: number; readonly v: number; readonly normal: number; readonly type: number;
  private readonly scale: number;  // pixels per ortho mm
  private readonly mirror: number;

  constructor(readonly name: SliceName, readonly rectangle: Rectangle, private readonly volume: LoadedVolume,
              private readonly camera: Camera, radiological: boolean) {
    ({ h: this.h, v: this.v, normal: this.normal, type: this.type } = SLICES[name]);
    const extent = (k: number) => Math.max(1e-6, volume.high[k] - volume.low[k]);
    this.scale = 0.96 * camera.zoom * Math.min(rectangle.width / extent(this.h), rectangle.height / extent(this.v));
    this.mirror = radiological && this.h === 0 ? -1 : 1;
  }

  get pixelsPerMm(): number { return this.scale; }

  /** Corners of what the pane shows in ortho mm, in the order h, v, normal. */
  field(): { low: Point; high: Point } {
    const w = this.rectangle.width / (2 * this.scale), t = this.rectangle.height / (2 * this.scale);
    const c = this.camera.centre;
    return { low: [c[this.h] - w, c[this.v] - t, this.volume.low[this.normal]],
      high: [c[this.h] + w, c[this.v] + t, this.volume.high[this.normal]] };
  }

  contains(x: number, y: number): boolean {
    const r = this.rectangle;
    return x >= r.left && x < r.left + r.width && y >= r.top && y < r.top + r.height;
  }

  /** Ortho mm -> pixels. */
  pixel(h: number, v: number): [number, number] {
    const r = this.rectangle, c = this.camera.centre;
    return [r.left + r.width / 2 + this.mirror * this.scale * (h - c[this.h]), r.top + r.height / 2 - this.scale * (v - c[this.v])];
  }
  pixelOf(fraction: Point): [number, number] {
    const o = this.volume.ortho(fraction);
    return this.pixel(o[this.h], o[this.v]);
  }

  /** Pixels -> a point in ortho mm on the slice through `at`. */
  ortho(x: number, y: number, at: Point): Point {
    const r = this.rectangle, c = this.camera.centre;
    const o = this.volume.ortho(at);
    o[this.h] = c[this.h] + this.mirror * (x - r.left - r.width / 2) / this.scale;
    o[this.v] = c[this.v] - (y - r.top - r.height / 2) / this.scale;
    return o;
  }
  fraction(x: number, y: number, at: Point): Point { return this.volume.fromOrthoPoint(this.ortho(x, y, at)); }

  /** The linear map of fractions along h and v to pixels (the box is straight in ortho mm). */
  map(): { x0: number; xh: number; y0: number; yv: number } {
    const [x0, y0] = this.pixelOf([0, 0, 0]), [x1, y1] = this.pixelOf([1, 1, 1]);
    return { x0, xh: x1 - x0, y0, yv: y1 - y0 };
  }

  /** Letters at the left, top, right and bottom edge. */
  letters(): [string, string, string, string] {
    const left = this.h === 1 ? 'P' : this.mirror < 0 ? 'R' : 'L';
    const right = this.h === 1 ? 'A' : this.mirror < 0 ? 'L' : 'R';
    return [left, this.v === 1 ? 'A' : 'S', right, this.v === 1 ? 'P' : 'I'];
  }
}
