// The line at the foot: what lies under the mouse, what the program does, whether it is there.
import { byId, millilitres, number, refill, h } from './dom';
import type { Point } from './protocol';
import { page, volume } from './state';
import { loaded, crosshairWorld, crosshairFraction } from './slices';

const points = (p: Point, digits: number) => p.map((x) => (Number(x.toFixed(digits)) || 0).toFixed(digits)).join(', ');  // no -0.0

let under: { world: Point; value: number } | null = null;

/** Under the mouse, or at the crosshair where the mouse is elsewhere. */
export function tellPosition(world: Point | null, value: number | null): void {
  under = world && value !== null ? { world, value } : null;
  drawPosition();
}

export function drawPosition(): void {
  const here = crosshairWorld();
  const what = under ?? (here && loaded ? { world: here, value: loaded.value(crosshairFraction()) } : null);
  const cells = byId('position');
  if (!what || !loaded) { refill(cells); return; }
  const { world, value } = what;
  const cell = (name: string, text: string) => h('span', { class: 'cell' }, h('span', { class: 'cell-name' }, name), text);
  refill(cells, h('span', { class: 'cell-where' }, under ? 'mouse' : 'crosshair'),
    cell('value', `${number(value, 5)}${loaded.about.is_ct ? ' HU' : ''}`),
    cell('RAS', `${points(world, 1)} mm`), cell('LPS', `${points([-world[0], -world[1], world[2]], 1)} mm`),
    cell('voxel', points(loaded.index(world), 0)));
}

const STAGES: Record<string, string> = { open: 'opening', evolve: 'evolving', search: 'searching', repeat: 'making it again' };

export function jobWords(): string {
  const job = page.job;
  if (!job) return '';
  const what = STAGES[job.what] ?? job.what;
  const stage = job.stage && job.stage !== job.what ? `, ${job.stage}` : '';
  return `${what}${stage}${job.step ? `, step ${job.step}` : ''}${job.seconds !== undefined ? `, ${job.seconds.toFixed(1)} s` : ''}`;
}

const BETWEEN_WORDS = 250;  // ms: each change has the whole page composed anew
let turn = 0;
/** While something is computed the spinners turn by an eighth now and then. */
export function startSpinners(): void {
  setInterval(() => {
    const waiting = page.job || !page.state || (volume() && !loaded);
    if (!waiting) return;
    turn = (turn + 1) % 8;
    document.documentElement.style.setProperty('--turn', `${turn / 8}turn`);
  }, BETWEEN_WORDS);
}

let told = '', shown = { job: '', at: 0 };
export function drawStatus(): void {
  const now = performance.now(), job = page.job ? `${page.job.id}` : '';
  if (job !== shown.job || now - shown.at > BETWEEN_WORDS) {
    byId('job').textContent = jobWords();
    shown = { job, at: now };
  }
  byId('job-spinner').hidden = !page.job;
  byId('lost').hidden = page.connected;
  // Screen readers hear the ends of things, not ten steps a second.
  const o = page.state?.objects.find((x) => x.id === page.view.active);
  const words = page.job ? `${STAGES[page.job.what] ?? page.job.what}` : o?.message
    ? `${o.name}: ${o.message}${o.measures?.volume_ml !== undefined ? ` ${millilitres(o.measures.volume_ml)}` : ''}` : '';
  if (words !== told) { told = words; byId('spoken').textContent = words; }
}
