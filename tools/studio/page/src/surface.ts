// A surface as the program sends it, and its cut with a slice.

export interface Surface {
  frame: number;
  points: Float32Array;       // RAS mm
  triangles: Uint32Array;
  deviation: Float32Array | null;  // mm
  edge: Float32Array | null;
}

export function readSurface(buffer: ArrayBuffer): Surface {
  if (buffer.byteLength < 16) throw new Error('a surface without its header');
  const [n, m, arrays, frame] = new Uint32Array(buffer, 0, 4);
  const size = 16 + 12 * n + 12 * m + 4 * n * arrays;
  if (buffer.byteLength < size) throw new Error(`a surface of ${buffer.byteLength} bytes, ${size} expected`);
  const array = (k: number) => (k < arrays ? new Float32Array(buffer, 16 + 12 * n + 12 * m + 4 * n * k, n) : null);
  return { frame, points: new Float32Array(buffer, 16, 3 * n), triangles: new Uint32Array(buffer, 16 + 12 * n, 3 * m),
    deviation: array(0), edge: array(1) };
}

/** Where a surface meets the plane p[axis] = value: the end points of segments, two coordinates each (those of h and v). */
export function cut(points: Float32Array, triangles: Uint32Array, axis: number, value: number, h: number, v: number): number[] {
  const ends: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const i = 3 * triangles[t], j = 3 * triangles[t + 1], k = 3 * triangles[t + 2];
    const a = points[i + axis] - value, b = points[j + axis] - value, c = points[k + axis] - value;
    const x = a >= 0, y = b >= 0, z = c >= 0;
    if (x === y && y === z) continue;
    // The corner that is alone on its side shares both edges that are cut.
    if (y === z) edge(points, i, a, j, b, k, c, h, v, ends);
    else if (x === z) edge(points, j, b, k, c, i, a, h, v, ends);
    else edge(points, k, c, i, a, j, b, h, v, ends);
  }
  return ends;
}

function edge(p: Float32Array, alone: number, d: number, one: number, d1: number, two: number, d2: number,
              h: number, v: number, ends: number[]): void {
  const s = d / (d - d1), t = d / (d - d2);
  ends.push(p[alone + h] + s * (p[one + h] - p[alone + h]), p[alone + v] + s * (p[one + v] - p[alone + v]),
    p[alone + h] + t * (p[two + h] - p[alone + h]), p[alone + v] + t * (p[two + v] - p[alone + v]));
}
