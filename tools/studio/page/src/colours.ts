// Colours of values on a mesh: what is doubtful is dark red, what is sure is pale.

type Rgb = [number, number, number];
// Deviation: pale to dark red, as it grows. Edge strength: the same, as it falls.
const STOPS: Rgb[] = [[0.93, 0.93, 0.90], [0.99, 0.80, 0.50], [0.96, 0.50, 0.26], [0.78, 0.15, 0.16], [0.42, 0.02, 0.10]];

export function colourMap(kind: 'deviation' | 'edge', share: number): Rgb {
  const s = Math.max(0, Math.min(1, Number.isFinite(share) ? share : 1));
  const at = (kind === 'edge' ? 1 - s : s) * (STOPS.length - 1), k = Math.min(STOPS.length - 2, Math.floor(at)), f = at - k;
  return STOPS[k].map((x, i) => x + f * (STOPS[k + 1][i] - x)) as Rgb;
}

/** From the smallest value to the 98th percentile: a single spike would make all else look alike. */
export function rangeOf(values: Float32Array): [number, number] {
  const sorted = values.filter(Number.isFinite).sort();
  if (!sorted.length) return [0, 1];
  return [sorted[0], Math.max(sorted[Math.floor(0.98 * (sorted.length - 1))], sorted[0] + 1e-6)];
}

export function cssGradient(kind: 'deviation' | 'edge'): string {
  const stops = [0, 0.25, 0.5, 0.75, 1].map((s) => `rgb(${colourMap(kind, s).map((x) => Math.round(255 * x)).join(' ')})`);
  return `linear-gradient(to right, ${stops.join(', ')})`;
}
