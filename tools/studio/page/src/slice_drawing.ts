// What is drawn over a slice, each on a canvas and a view that are given.
import type { Point } from './protocol';
import type { SliceView } from './geometry';
import { cut } from './surface';

export interface Line { colour: string; width: number; dash: number[] }

/** A surface where it crosses the slice. */
export function drawOutline(c: CanvasRenderingContext2D, view: SliceView, crosshair: Point, fractions: Float32Array,
                            triangles: Uint32Array, { colour, width, dash }: Line): void {
  const ends = cut(fractions, triangles, view.normal, crosshair[view.normal], view.h, view.v);
  const { x0, xh, y0, yv } = view.map();
  c.beginPath();
  for (let i = 0; i < ends.length; i += 4) {
    c.moveTo(x0 + xh * ends[i], y0 + yv * ends[i + 1]);
    c.lineTo(x0 + xh * ends[i + 2], y0 + yv * ends[i + 3]);
  }
  c.lineCap = 'round';
  c.setLineDash(dash);
  // A dark seam keeps the line legible on bright tissue.
  if (!dash.length) { c.strokeStyle = 'rgba(0,0,0,.55)'; c.lineWidth = width + 1.5; c.stroke(); }
  c.strokeStyle = colour;
  c.lineWidth = width;
  c.stroke();
  c.setLineDash([]);
}

export function drawCrosshair(c: CanvasRenderingContext2D, view: SliceView, crosshair: Point): void {
  const [x, y] = view.pixelOf(crosshair), r = view.rectangle, gap = 12;
  c.strokeStyle = 'rgba(110,168,254,.75)';
  c.lineWidth = 1;
  c.beginPath();
  const px = Math.round(x) + 0.5, py = Math.round(y) + 0.5;
  c.moveTo(r.left, py); c.lineTo(px - gap, py); c.moveTo(px + gap, py); c.lineTo(r.left + r.width, py);
  c.moveTo(px, r.top); c.lineTo(px, py - gap); c.moveTo(px, py + gap); c.lineTo(px, r.top + r.height);
  c.stroke();
}

/** Inside: a green disc with a plus; outside: a red one with a minus, so that not only the colour tells. */
export function drawMark(c: CanvasRenderingContext2D, x: number, y: number, side: string, radius: number, ring: boolean): void {
  if (ring) {
    c.beginPath(); c.arc(x, y, radius + 3.5, 0, 7);
    c.strokeStyle = '#fff'; c.lineWidth = 1.5; c.stroke();
  }
  c.beginPath(); c.arc(x, y, radius, 0, 7);
  c.fillStyle = side === 'inside' ? '#2fbf4f' : '#f0483e';
  c.fill();
  c.strokeStyle = 'rgba(0,0,0,.7)'; c.lineWidth = 1; c.stroke();
  const arm = radius * 0.55;
  c.beginPath();
  c.moveTo(x - arm, y); c.lineTo(x + arm, y);
  if (side === 'inside') { c.moveTo(x, y - arm); c.lineTo(x, y + arm); }
  c.strokeStyle = '#fff'; c.lineWidth = 1.6; c.stroke();
}

/** Which way is left, right, up and down. */
export function drawLetters(c: CanvasRenderingContext2D, view: SliceView): void {
  const r = view.rectangle, [left, top, right, bottom] = view.letters();
  c.font = '600 13px system-ui, sans-serif';
  c.textAlign = 'center';
  c.textBaseline = 'middle';
  const write = (text: string, x: number, y: number) => {
    c.lineWidth = 3; c.strokeStyle = 'rgba(0,0,0,.8)'; c.strokeText(text, x, y);
    c.fillStyle = '#ffcf6b'; c.fillText(text, x, y);
  };
  write(left, r.left + 12, r.top + r.height / 2);
  write(right, r.left + r.width - 30, r.top + r.height / 2);  // left of the slider
  write(top, r.left + r.width / 2, r.top + 13);
  write(bottom, r.left + r.width / 2, r.top + r.height - 12);
}

/** The longest round length that takes a fifth of the pane. */
export function drawScale(c: CanvasRenderingContext2D, view: SliceView): void {
  const r = view.rectangle;
  const length = [500, 200, 100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1].find((mm) => mm * view.pixelsPerMm <= 0.22 * r.width);
  if (!length) return;
  const w = length * view.pixelsPerMm, x = r.left + r.width - 14 - w, y = r.top + r.height - 14;
  c.strokeStyle = 'rgba(0,0,0,.8)'; c.lineWidth = 4;
  const path = () => { c.beginPath(); c.moveTo(x, y - 4); c.lineTo(x, y); c.lineTo(x + w, y); c.lineTo(x + w, y - 4); c.stroke(); };
  path();
  c.strokeStyle = '#d5dae1'; c.lineWidth = 1.25;
  path();
  c.font = '11px system-ui, sans-serif'; c.textAlign = 'center'; c.textBaseline = 'bottom';
  const words = length >= 10 ? `${length / 10} cm` : `${length} mm`;
  c.lineWidth = 3; c.strokeStyle = 'rgba(0,0,0,.8)'; c.strokeText(words, x + w / 2, y - 4);
  c.fillStyle = '#d5dae1'; c.fillText(words, x + w / 2, y - 4);
}
