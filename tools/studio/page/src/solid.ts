// The 3-D pane: the surfaces by WebGL, over them clicks and axes. It draws by itself because NiiVue uploads its volume again for every
// mesh it is given, and a surface that evolves gives ten a second.
import type { Point } from './protocol';
import { byId } from './dom';
import { colourMap, rangeOf } from './colours';
import { GRAPHICS_LOST, showError } from './messages';
import { drawMark } from './slice_drawing';
import { page } from './state';
import { surfaces, type Shown } from './surfaces';

const VERTEX = `#version 300 es
uniform mat4 place; uniform mat3 turn;
in vec3 point; in vec3 normal; in vec3 colour;
out vec3 n; out vec3 c;
void main() { n = turn * normal; c = colour; gl_Position = place * vec4(point, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 n; in vec3 c; out vec4 result;
void main() {
  vec3 m = normalize(n);
  if (!gl_FrontFacing) m = -m;
  float lamp = max(dot(m, normalize(vec3(-0.35, 0.55, 0.75))), 0.0), rim = max(dot(m, normalize(vec3(0.6, -0.3, 0.5))), 0.0);
  float shine = pow(max(dot(m, normalize(vec3(-0.2, 0.32, 0.92))), 0.0), 40.0);
  result = vec4(c * (0.30 + 0.62 * lamp + 0.14 * rim) + 0.16 * shine, 1.0);
}`;

interface Drawn { from: Shown; colour: string; count: number; array: WebGLVertexArrayObject; buffers: WebGLBuffer[] }

let gl: WebGL2RenderingContext;
let program: WebGLProgram;
const drawn = new Map<number, Drawn>();
let rotation: number[] = [-1, 0, 0, 0, 0, 1, 0, 1, 0];  // columns; world -> eye, from the front
let centre: Point | null = null;
let radius = 1;
let zoomed = 1;
let shift: [number, number] = [0, 0];  // pixels
let scheduled = false;
let drag: { x: number; y: number; button: number; moved: boolean; pan: boolean } | null = null;
let onPick: (world: Point) => void = () => {};
let crosshair: () => Point | null = () => null;

const canvas = () => byId<HTMLCanvasElement>('solid');
const over = () => byId<HTMLCanvasElement>('solid-overlay');

export function startSolid(pick: (world: Point) => void, where: () => Point | null): void {
  onPick = pick;
  crosshair = where;
  const context = canvas().getContext('webgl2', { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!context) throw new Error('This browser offers no WebGL 2, which the views need.');
  gl = context;
  program = gl.createProgram()!;
  for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  ['point', 'normal', 'colour'].forEach((name, k) => gl.bindAttribLocation(program, k, name));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`WebGL: ${gl.getProgramInfoLog(program)}`);
  canvas().addEventListener('webglcontextlost', () => showError(GRAPHICS_LOST));
  const top = over();
  top.addEventListener('pointerdown', (event) => {
    event.preventDefault();
    if (gl.isContextLost()) return;
    byId('pane-solid').focus({ preventScroll: true });
    top.setPointerCapture(event.pointerId);
    drag = { x: event.clientX, y: event.clientY, button: event.button, moved: false, pan: event.button !== 0 || event.shiftKey };
  });
  top.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
    if (!drag.moved && Math.hypot(dx, dy) < 3) return;
    drag.moved = true;
    drag.x = event.clientX;
    drag.y = event.clientY;
    if (drag.pan) { shift[0] += dx; shift[1] += dy; } else turn(dx / 150, dy / 150);
    drawSolid();
  });
  top.addEventListener('pointerup', (event) => {
    const done = drag;
    drag = null;
    if (!done || done.moved || done.button !== 0) return;
    const r = top.getBoundingClientRect();
    const hit = pickAt(event.clientX - r.left, event.clientY - r.top);
    if (hit) onPick(hit);
  });
  top.addEventListener('pointercancel', () => { drag = null; });
  top.addEventListener('contextmenu', (event) => event.preventDefault());
  top.addEventListener('mousedown', (event) => { if (event.button === 1) event.preventDefault(); });
  top.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoomSolid(Math.exp(-event.deltaY / 500));
  }, { passive: false });
}

/** Turns by radians about the vertical and the horizontal of the screen. */
export function turn(right: number, downwards: number): void {
  const a = Math.cos(right), b = Math.sin(right), c = Math.cos(downwards), d = Math.sin(downwards);
  const r = rotation.slice();
  for (let k = 0; k < 3; k++) {
    const x = r[3 * k], y = r[3 * k + 1], z = r[3 * k + 2];
    const x1 = a * x + b * z, z1 = -b * x + a * z;
    rotation[3 * k] = x1;
    rotation[3 * k + 1] = c * y - d * z1;
    rotation[3 * k + 2] = d * y + c * z1;
  }
  drawSolid();
}

/** Columns: where right, anterior and superior of the patient go on the screen (right, up, towards the eye). */
export function solidRotation(): number[] { return rotation.slice(); }

export function zoomSolid(factor: number): void {
  zoomed = Math.max(0.2, Math.min(30, zoomed * factor));
  drawSolid();
}

export type Direction = 'front' | 'left' | 'above';
const LOOK: Record<Direction, number[]> = {
  front: [-1, 0, 0, 0, 0, 1, 0, 1, 0],
  left: [0, 0, -1, -1, 0, 0, 0, 1, 0],
  above: [1, 0, 0, 0, 1, 0, 0, 0, 1],
};
export function lookFrom(direction: Direction): void {
  rotation = LOOK[direction].slice();
  resetSolid();
}

export function resetSolid(): void {
  zoomed = 1;
  shift = [0, 0];
  centre = null;
  drawSolid();
}

/** A surface has come, changed its colour or gone. */
export function drawSolid(): void {
  if (scheduled || !gl) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    paint();
  });
}

function visible(): [number, Shown][] { return [...surfaces].filter(([id]) => !page.view.hidden.has(id)); }

/** Frames what is seen; it glides, so that a growing surface does not make the view jump. */
function frame(): boolean {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const [, s] of visible())
    for (let i = 0; i < s.points.length; i++) {
      const k = i % 3, x = s.points[i];
      if (x < low[k]) low[k] = x;
      if (x > high[k]) high[k] = x;
    }
  if (low[0] > high[0]) return false;
  const target = low.map((x, k) => (x + high[k]) / 2) as Point;
  const size = Math.max(1e-3, Math.hypot(...low.map((x, k) => high[k] - x)) / 2);
  if (!centre) { centre = target; radius = size; return false; }
  const away = Math.hypot(...centre.map((x, k) => x - target[k])) / size + Math.abs(radius - size) / size;
  if (away < 0.01) { centre = target; radius = size; return false; }
  const share = 0.2;
  centre = centre.map((x, k) => x + share * (target[k] - x)) as Point;
  radius += share * (size - radius);
  return true;
}

function scale(): number {
  const { clientWidth: w, clientHeight: t } = canvas();
  return 0.44 * Math.min(w, t) * zoomed / radius;
}

function eye(p: ArrayLike<number>, at = 0): Point {
  const c = centre!, x = p[at] - c[0], y = p[at + 1] - c[1], z = p[at + 2] - c[2], r = rotation;
  return [r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z];
}

function pixel(p: ArrayLike<number>, at = 0): Point {
  const { clientWidth: w, clientHeight: t } = canvas();
  const e = eye(p, at), s = scale();
  return [w / 2 + shift[0] + s * e[0], t / 2 + shift[1] - s * e[1], e[2]];
}

function paint(): void {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: w, clientHeight: t } = canvas();
  for (const c of [canvas(), over()])
    if (c.width !== Math.round(w * ratio) || c.height !== Math.round(t * ratio)) {
      c.width = Math.max(1, Math.round(w * ratio));
      c.height = Math.max(1, Math.round(t * ratio));
    }
  gl.viewport(0, 0, canvas().width, canvas().height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  upload();
  const gliding = frame();
  if (centre && drawn.size && w && t) {
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const s = scale(), r = rotation, c = centre, sx = 2 * s / w, sy = 2 * s / t, sz = -0.25 / Math.max(radius, 1e-6);
    const m = new Float32Array(16);
    for (let k = 0; k < 3; k++) { m[4 * k] = sx * r[3 * k]; m[4 * k + 1] = sy * r[3 * k + 1]; m[4 * k + 2] = sz * r[3 * k + 2]; }
    for (let row = 0; row < 3; row++) m[12 + row] = -(m[row] * c[0] + m[4 + row] * c[1] + m[8 + row] * c[2]);
    m[12] += 2 * shift[0] / w;
    m[13] -= 2 * shift[1] / t;
    m[15] = 1;
    gl.uniformMatrix4fv(gl.getUniformLocation(program, 'place'), false, m);
    gl.uniformMatrix3fv(gl.getUniformLocation(program, 'turn'), false, new Float32Array(r));
    for (const d of drawn.values()) {
      gl.bindVertexArray(d.array);
      gl.drawElements(gl.TRIANGLES, d.count, gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
  }
  paintOver(ratio);
  if (gliding) drawSolid();
}

/** Brings the buffers to what is to be seen. */
function upload(): void {
  const seen = visible();
  for (const [id, d] of drawn)
    if (!seen.some(([other]) => other === id)) { free(d); drawn.delete(id); }
  for (const [id, s] of seen) {
    const o = page.state?.objects.find((x) => x.id === id);
    const by = page.view.meshColour, colour = `${o?.colour ?? '#cccccc'} ${by}`;
    const old = drawn.get(id);
    if (old && old.from === s && old.colour === colour) continue;
    if (old) free(old);
    drawn.set(id, make(s, colour, colours(s, o?.colour ?? '#cccccc')));
  }
}

function colours(s: Shown, plain: string): Float32Array {
  const n = s.points.length / 3, out = new Float32Array(3 * n);
  const by = page.view.meshColour, values = by === 'deviation' ? s.deviation : by === 'edge' ? s.edge : null;
  if (values) {
    const [low, high] = rangeOf(values);
    for (let i = 0; i < n; i++) out.set(colourMap(by as 'deviation' | 'edge', (values[i] - low) / (high - low || 1)), 3 * i);
    return out;
  }
  const v = parseInt(plain.slice(1), 16), rgb = [(v >> 16) / 255, ((v >> 8) & 255) / 255, (v & 255) / 255];
  for (let i = 0; i < n; i++) out.set(rgb, 3 * i);
  return out;
}

function normals(s: Shown): Float32Array {
  const p = s.points, out = new Float32Array(p.length);
  for (let t = 0; t < s.triangles.length; t += 3) {
    const i = 3 * s.triangles[t], j = 3 * s.triangles[t + 1], k = 3 * s.triangles[t + 2];
    const ax = p[j] - p[i], ay = p[j + 1] - p[i + 1], az = p[j + 2] - p[i + 2];
    const bx = p[k] - p[i], by = p[k + 1] - p[i + 1], bz = p[k + 2] - p[i + 2];
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    for (const c of [i, j, k]) { out[c] += x; out[c + 1] += y; out[c + 2] += z; }
  }
  return out;
}

function make(s: Shown, colour: string, rgb: Float32Array): Drawn {
  const array = gl.createVertexArray()!;
  gl.bindVertexArray(array);
  const buffers = [s.points, normals(s), rgb].map((data, k) => {
    const buffer = gl.createBuffer()!;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 0, 0);
    return buffer;
  });
  const index = gl.createBuffer()!;
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, s.triangles, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return { from: s, colour, count: s.triangles.length, array, buffers: [...buffers, index] };
}

function free(d: Drawn): void {
  gl.deleteVertexArray(d.array);
  for (const buffer of d.buffers) gl.deleteBuffer(buffer);
}

function paintOver(ratio: number): void {
  const c = over().getContext('2d')!, t = over().clientHeight;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, over().width, over().height);
  if (centre) {
    for (const o of page.state?.objects ?? []) {
      if (page.view.hidden.has(o.id)) continue;
      const mine = o.id === page.view.active;
      o.clicks.forEach((click, index) => {
        const [x, y] = pixel(click.point);
        c.globalAlpha = mine ? 0.9 : 0.5;
        drawMark(c, x, y, click.side, mine ? 5 : 4, page.view.click?.object === o.id && page.view.click.index === index);
      });
    }
    c.globalAlpha = 1;
    const here = crosshair();
    if (here && page.view.crosshair && visible().length) {
      const [x, y] = pixel(here);
      c.strokeStyle = 'rgba(110,168,254,.9)';
      c.lineWidth = 1.25;
      c.beginPath();
      c.moveTo(x - 9, y); c.lineTo(x - 3, y); c.moveTo(x + 3, y); c.lineTo(x + 9, y);
      c.moveTo(x, y - 9); c.lineTo(x, y - 3); c.moveTo(x, y + 3); c.lineTo(x, y + 9);
      c.stroke();
    }
  }
  // The patient's axes: right, anterior, superior.
  const ends: [string, string, number][] = [['R', '#ff7b72', 0], ['A', '#56d364', 1], ['S', '#79b8ff', 2]];
  ends.sort((a, b) => rotation[3 * a[2] + 2] - rotation[3 * b[2] + 2]);
  c.font = '600 11px system-ui, sans-serif';
  c.textAlign = 'center';
  c.textBaseline = 'middle';
  for (const [letter, colour, k] of ends) {
    const x = 38 + 20 * rotation[3 * k], y = t - 38 - 20 * rotation[3 * k + 1];
    c.strokeStyle = colour;
    c.lineWidth = 1.5;
    c.beginPath(); c.moveTo(38, t - 38); c.lineTo(x, y); c.stroke();
    c.fillStyle = colour;
    c.fillText(letter, 38 + 29 * rotation[3 * k], t - 38 - 29 * rotation[3 * k + 1]);
  }
}

/** The point of a surface that is seen at a pixel. */
function pickAt(x: number, y: number): Point | null {
  if (!centre) return null;
  let best: Point | null = null, nearest = -Infinity;
  for (const [, s] of visible()) {
    const n = s.points.length, q = new Float32Array(n);
    for (let i = 0; i < n; i += 3) q.set(pixel(s.points, i), i);
    for (let t = 0; t < s.triangles.length; t += 3) {
      const i = 3 * s.triangles[t], j = 3 * s.triangles[t + 1], k = 3 * s.triangles[t + 2];
      const det = (q[j] - q[i]) * (q[k + 1] - q[i + 1]) - (q[k] - q[i]) * (q[j + 1] - q[i + 1]);
      if (!det) continue;
      const b = ((x - q[i]) * (q[k + 1] - q[i + 1]) - (q[k] - q[i]) * (y - q[i + 1])) / det;
      const c = ((q[j] - q[i]) * (y - q[i + 1]) - (x - q[i]) * (q[j + 1] - q[i + 1])) / det;
      if (b < 0 || c < 0 || b + c > 1) continue;
      const z = q[i + 2] + b * (q[j + 2] - q[i + 2]) + c * (q[k + 2] - q[i + 2]);
      if (z <= nearest) continue;
      nearest = z;
      best = [0, 1, 2].map((a) => s.points[i + a] + b * (s.points[j + a] - s.points[i + a])
        + c * (s.points[k + a] - s.points[i + a])) as Point;
    }
  }
  return best;
}
lookFrom('front');
