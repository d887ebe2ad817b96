// The surfaces of the objects, kept as new as the program's: one request at a time, the newest frame wins.
import { readSurface, type Surface } from './surface';
import { page } from './state';
import { get, RequestError } from './server';

export interface Shown extends Surface { fractions: Float32Array | null; key: string }

export const surfaces = new Map<number, Shown>();
const wanted = new Map<number, string>();
const have = new Map<number, string>();
let fetching = false;
let onNew: (object: number) => void = () => {};

export function onNewSurface(listener: (object: number) => void): void { onNew = listener; }

/** After a state: what each object's surface should be. */
export function followState(): void {
  const objects = page.state?.objects ?? [];
  for (const id of [...surfaces.keys(), ...wanted.keys()])
    if (!objects.some((o) => o.id === id && (o.has_surface || page.job?.object === id))) drop(id);
  for (const o of objects)
    // While it evolves its frames are newer.
    if (o.has_surface && !(page.job?.object === o.id && page.job.frame)) wanted.set(o.id, `surface ${o.surface}`);
  void work();
}

/** After a progress event: a frame of the object that evolves. */
export function followJob(): void {
  const job = page.job;
  if (job?.object === undefined || job.object === null || job.frame === undefined || job.frame <= 0) return;
  wanted.set(job.object, `job ${job.id} ${job.frame}`);
  void work();
}

export function forgetSurfaces(): void { for (const id of [...surfaces.keys(), ...wanted.keys()]) drop(id); }

function drop(id: number): void {
  wanted.delete(id);
  have.delete(id);
  if (surfaces.delete(id)) onNew(id);
}

async function work(): Promise<void> {
  if (fetching) return;
  fetching = true;
  try {
    for (;;) {
      const next = [...wanted].find(([id, key]) => have.get(id) !== key);
      if (!next) return;
      const [id, key] = next;
      have.set(id, key);
      try {
        const buffer = await (await get(`/api/surface?object=${id}`)).arrayBuffer();
        if (!wanted.has(id)) continue;
        surfaces.set(id, { ...readSurface(buffer), fractions: null, key });
        onNew(id);
      } catch (error) {
        // 404: there is none yet, or no longer; a lost connection is told by the events.
        if (!(error instanceof RequestError)) have.delete(id);
        if (!(error instanceof RequestError)) return;
      }
    }
  } finally {
    fetching = false;
  }
}
