// The window: which values are black and white. Presets of CT in Hounsfield units, and automatic for all else.
import { byId, h, refill } from './dom';
import { volume } from './state';
import { range, setRange } from './slices';

const CT: [string, string, number, number][] = [  // name, words, level, width
  ['soft', 'soft tissue', 40, 400], ['bone', 'bone', 500, 2000], ['lung', 'lung', -600, 1500], ['brain', 'brain', 40, 80],
];

let shownFor = -1;

/** The choices fit the volume: presets of CT for CT only. */
export function drawWindowChoices(): void {
  const v = volume();
  if ((v?.revision ?? -1) === shownFor) return;
  shownFor = v?.revision ?? -1;
  refill(byId('window-preset'), h('option', { value: 'automatic' }, 'automatic'),
    ...(v?.is_ct ? CT.map(([key, words]) => h('option', { value: key }, words)) : []),
    h('option', { value: 'full' }, 'full range'), h('option', { value: 'own', hidden: true }, 'by hand'));
}

export function windowChanged(byHand = true): void {
  byId<HTMLInputElement>('window-level').value = rounded((range[0] + range[1]) / 2);
  byId<HTMLInputElement>('window-width').value = rounded(range[1] - range[0]);
  if (byHand) byId<HTMLSelectElement>('window-preset').value = 'own';
}
function rounded(x: number): string { return String(Math.abs(x) >= 100 ? Math.round(x) : Number(x.toPrecision(4))); }

export function choosePreset(key: string): void {
  const v = volume();
  if (!v) return;
  const ct = CT.find(([k]) => k === key);
  if (ct) setRange(ct[2] - ct[3] / 2, ct[2] + ct[3] / 2);
  else if (key === 'full' || !v.window) setRange(v.minimum, v.maximum);
  else setRange(v.window[0], v.window[1]);
  windowChanged(false);
  byId<HTMLSelectElement>('window-preset').value = key;
}

/** The next choice of the list, for the keyboard. */
export function nextPreset(): void {
  const select = byId<HTMLSelectElement>('window-preset');
  const keys = [...select.options].filter((o) => !o.hidden).map((o) => o.value);
  choosePreset(keys[(keys.indexOf(select.value) + 1) % keys.length]);
}

export function startWindow(): void {
  byId('window-preset').addEventListener('change', (e) => choosePreset((e.target as HTMLSelectElement).value));
  for (const id of ['window-level', 'window-width'])
    byId(id).addEventListener('change', () => {
      const level = Number(byId<HTMLInputElement>('window-level').value), width = Number(byId<HTMLInputElement>('window-width').value);
      if (Number.isFinite(level) && width > 0) setRange(level - width / 2, level + width / 2);
      windowChanged();
    });
}
