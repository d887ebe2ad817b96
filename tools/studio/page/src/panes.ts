// The four panes: where they are, one of them large if wanted, their titles, sliders and buttons.
import { byId, h, iconButton } from './dom';
import { type Rectangle, SLICE_NAMES, SLICES, type SliceName } from './geometry';
import { type Pane, page, setView, volume } from './state';
import { crosshairWorld, layOut, resetView, setSlice, sliceNumber } from './slices';
import { drawSolid, lookFrom, resetSolid } from './solid';

export const PANES: Pane[] = [...SLICE_NAMES, 'solid'];
const TITLES: Record<Pane, string> = { axial: 'Axial', coronal: 'Coronal', sagittal: 'Sagittal', solid: '3-D' };
const GAP = 2;

export function startPanes(): void {
  for (const pane of PANES) {
    const header = h('div', { class: 'pane-header' },
      h('span', { class: 'pane-title' }, TITLES[pane]),
      pane === 'solid' ? h('span', { class: 'pane-buttons' },
        ...(['front', 'left', 'above'] as const).map((d) => h('button', { type: 'button', class: 'tiny', title: `Look from ${d === 'above' ? d : `the ${d}`}`,
          onclick: () => lookFrom(d) }, d)),
        iconButton('fit', 'Fit the view', () => resetSolid())) : h('span', { class: 'slice-number', id: `number-${pane}` }),
      pane === 'solid' ? null : iconButton('fit', 'Fit the slices (0)', () => resetView()),
      iconButton('maximise', `Enlarge ${TITLES[pane]} (${PANES.indexOf(pane) + 1})`, () => maximise(pane)));
    byId(`pane-${pane}`).append(header);
    if (pane === 'solid') continue;
    const name = pane as SliceName;
    byId(`pane-${pane}`).append(h('input', { type: 'range', class: 'slider', id: `slider-${pane}`, min: '1', step: '1', value: '1', tabindex: '-1',
      'aria-label': `${SLICES[name].title} slice`,
      oninput: (e: Event) => setSlice(name, Number((e.target as HTMLInputElement).value)) }));
  }
  new ResizeObserver(() => arrange()).observe(byId('views'));
}

export function maximise(pane: Pane): void {
  setView({ maximised: page.view.maximised === pane ? null : pane });
  arrange();
}

export function arrange(): void {
  const stage = byId('views'), w = stage.clientWidth, t = stage.clientHeight;
  const left = Math.floor((w - GAP) / 2), top = Math.floor((t - GAP) / 2);
  const places: Record<Pane, Rectangle> = {
    axial: { left: 0, top: 0, width: left, height: top },
    coronal: { left: left + GAP, top: 0, width: w - left - GAP, height: top },
    sagittal: { left: 0, top: top + GAP, width: left, height: t - top - GAP },
    solid: { left: left + GAP, top: top + GAP, width: w - left - GAP, height: t - top - GAP },
  };
  const big = page.view.maximised;
  const rectangles = new Map<SliceName, Rectangle>();
  for (const pane of PANES) {
    const r = big === pane ? { left: 0, top: 0, width: w, height: t } : places[pane];
    const elements = [byId(`pane-${pane}`), ...(pane === 'solid' ? [byId('solid'), byId('solid-overlay')] : [])];
    for (const element of elements) {
      element.hidden = big !== null && big !== pane;
      Object.assign(element.style, { left: `${r.left}px`, top: `${r.top}px`, width: `${r.width}px`, height: `${r.height}px` });
    }
    if (pane !== 'solid' && (big === null || big === pane)) rectangles.set(pane, r);
  }
  layOut(rectangles);
  drawSolid();
}

export function drawPanes(): void {
  const open = !!volume() && !!crosshairWorld();
  for (const name of SLICE_NAMES) {
    const [k, n] = sliceNumber(name), slider = byId<HTMLInputElement>(`slider-${name}`);
    slider.disabled = !open;
    slider.max = String(n || 1);
    slider.value = String(k);
    byId(`number-${name}`).textContent = open ? `${k} / ${n}` : '';
  }
}
