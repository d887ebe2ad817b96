// The volume: fetched with a progress bar, decompressed by the browser as it comes in, its values, and the map of its slices.
import { Niivue, NVImage } from '@niivue/niivue';
import type { Point, Volume } from './protocol';
import { apply, applyAll, fromRows, invert, type Matrix } from './matrix';
import { get } from './server';

/** Reads /api/volume.nii.gz into one buffer; `progress` is told shares of it, 0..1. */
export async function fetchVolume(revision: number, progress: (share: number) => void): Promise<ArrayBuffer> {
  const response = await get(`/api/volume.nii.gz?revision=${revision}`);
  const length = Number(response.headers.get('Content-Length')) || 0;
  const reader = response.body!.getReader();
  let received = 0;
  const counted = async (controller: ReadableStreamDefaultController<BufferSource>) => {
    const { done, value } = await reader.read();
    if (done) { controller.close(); return; }
    received += value.length;
    if (length) progress(Math.min(1, received / length));
    controller.enqueue(value as Uint8Array<ArrayBuffer>);
  };
  const first = await reader.read();
  if (first.done) throw new Error('the volume came without a byte');
  received = first.value.length;
  const raw = new ReadableStream<BufferSource>({
    start(controller) { controller.enqueue(first.value as Uint8Array<ArrayBuffer>); }, pull: counted,
  });
  // Where the program also said Content-Encoding, the browser has already taken gzip away.
  const gzip = first.value[0] === 0x1f && first.value[1] === 0x8b;
  const plain = (gzip ? raw.pipeThrough(new DecompressionStream('gzip')) : raw) as unknown as ReadableStream<Uint8Array>;
  const chunks: Uint8Array[] = [];
  let bytes = 0, whole: Uint8Array | null = null;
  const out = plain.getReader();
  for (;;) {
    const { done, value } = await out.read();
    if (done) break;
    if (!whole) {
      chunks.push(value);
      bytes += value.length;
      if (bytes < 348) continue;
      // The header tells the size, so that a large volume is in memory once only.
      const head = new Uint8Array(bytes);
      chunks.reduce((at, c) => { head.set(c, at); return at + c.length; }, 0);
      const view = new DataView(head.buffer);
      const size = view.getInt16(42, true) * view.getInt16(44, true) * view.getInt16(46, true)
        * (view.getInt16(72, true) / 8) + view.getFloat32(108, true);
      whole = new Uint8Array(Math.max(size, bytes));
      whole.set(head);
    } else {
      if (bytes + value.length > whole.length) throw new Error('the volume is longer than its header says');
      whole.set(value, bytes);
      bytes += value.length;
    }
    if (!length) progress(bytes / whole.length);
  }
  if (!whole || bytes < whole.length) throw new Error('the volume ended too early');
  return whole.buffer as ArrayBuffer;
}

/**
 * A volume that NiiVue has. Its slices are planes of voxels whatever the affine, so positions in them are fractions of the volume along
 * its axes in RAS order, and drawing happens in "ortho" mm: the fractions times the axes' lengths, where every voxel is a box.
 */
export class LoadedVolume {
  readonly toWorld: Matrix;      // fractions -> RAS mm
  readonly fromWorld: Matrix;
  readonly toOrtho: Matrix;      // fractions -> ortho mm
  readonly fromOrtho: Matrix;
  readonly size: Point;          // voxels along the axes in RAS order
  readonly low: Point;           // of the box in ortho mm
  readonly high: Point;
  private readonly worldToIndex: Matrix;

  constructor(readonly image: NVImage, readonly about: Volume) {
    this.toWorld = Float64Array.from(image.frac2mm as unknown as number[]);
    this.fromWorld = invert(this.toWorld);
    this.toOrtho = Float64Array.from(image.frac2mmOrtho as unknown as number[]);
    this.fromOrtho = invert(this.toOrtho);
    this.size = image.dimsRAS!.slice(1, 4) as Point;
    const a = apply(this.toOrtho, [0, 0, 0]), b = apply(this.toOrtho, [1, 1, 1]);
    this.low = a.map((x, k) => Math.min(x, b[k])) as Point;
    this.high = a.map((x, k) => Math.max(x, b[k])) as Point;
    this.worldToIndex = invert(fromRows(about.index_to_world));
  }

  world(fraction: Point): Point { return apply(this.toWorld, fraction); }
  fraction(world: Point): Point { return apply(this.fromWorld, world); }
  fractions(points: Float32Array): Float32Array { return applyAll(this.fromWorld, points); }
  ortho(fraction: Point): Point { return apply(this.toOrtho, fraction); }
  fromOrthoPoint(ortho: Point): Point { return apply(this.fromOrtho, ortho); }
  isInside(fraction: Point): boolean { return fraction.every((x) => x >= 0 && x <= 1); }

  /** Index in the program's full volume, which the page may have coarser. */
  index(world: Point): Point {
    return apply(this.worldToIndex, world).map((x, k) => Math.max(0, Math.min(this.about.size[k] - 1, Math.round(x)))) as Point;
  }
  value(fraction: Point): number {
    const [x, y, z] = fraction.map((f, k) => Math.max(0, Math.min(this.size[k] - 1, Math.floor(f * this.size[k]))));
    return this.image.getValue(x, y, z);
  }
  /** The middle of the voxel: slices are shown where voxels are, not between them. */
  snapped(fraction: Point): Point {
    return fraction.map((f, k) => {
      const n = this.size[k];
      return (Math.max(0, Math.min(n - 1, Math.floor(f * n))) + 0.5) / n;
    }) as Point;
  }
}

/** A Niivue that draws where it is told to and listens to nothing. */
export async function makeNiivue(canvas: HTMLCanvasElement): Promise<Niivue> {
  const nv = new Niivue({
    isResizeCanvas: false, interactive: false, dragAndDropEnabled: false, isSliceMM: false, backColor: [0, 0, 0, 1],
    crosshairWidth: 0, meshThicknessOn2D: 0, isOrientationTextVisible: false, isColorbar: false, isRuler: false,
    loadingText: '', logLevel: 'error',
  } as ConstructorParameters<typeof Niivue>[0]);
  await nv.attachToCanvas(canvas, false);
  return nv;
}

export async function readVolume(buffer: ArrayBuffer, about: Volume): Promise<LoadedVolume> {
  const [low, high] = about.window ?? [about.minimum, about.maximum];
  const image = await NVImage.loadFromUrl({ url: buffer, name: 'volume.nii', colormap: 'gray', cal_min: low, cal_max: high });
  return new LoadedVolume(image, about);
}
