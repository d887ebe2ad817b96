// Small helpers for the DOM. Texts always become text nodes, never HTML.

type Child = Node | string | number | null | undefined | false;
type Attributes = Record<string, unknown>;

/** An element: keys that begin with "on" are listeners, known properties are set, all else are attributes. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value as EventListener);
    else if (key === 'class') element.className = String(value);
    else if (key === 'value' || key === 'checked' || key === 'disabled' || key === 'selected')
      (element as unknown as Attributes)[key] = value;
    else element.setAttribute(key, value === true ? '' : String(value));
  }
  element.append(...children.filter((c): c is Node | string | number => c !== null && c !== undefined && c !== false)
    .map((c) => (typeof c === 'number' ? String(c) : c)));
  return element;
}

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks #${id}`);
  return element as T;
}

const ICONS = {
  eye: 'M1 8s2.6-4.6 7-4.6S15 8 15 8s-2.6 4.6-7 4.6S1 8 1 8zM8 5.8a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4z',
  eyeOff: 'M2 2l12 12M6.2 3.6A7.6 7.6 0 0 1 8 3.4c4.4 0 7 4.6 7 4.6a12 12 0 0 1-2 2.5M4 5A11.6 11.6 0 0 0 1 8s2.6 4.6 7 4.6c1 0 1.9-.2 2.7-.6',
  cross: 'M4 4l8 8M12 4l-8 8',
  plus: 'M8 3v10M3 8h10',
  minus: 'M3 8h10',
  target: 'M8 1v4M8 11v4M1 8h4M11 8h4M8 7.4a.6.6 0 1 0 0 1.2.6.6 0 0 0 0-1.2',
  undo: 'M6 3L2.5 6.5 6 10M2.5 6.5H10a3.5 3.5 0 0 1 0 7H7',
  redo: 'M10 3l3.5 3.5L10 10M13.5 6.5H6a3.5 3.5 0 0 0 0 7h3',
  stop: 'M4 4h8v8H4z',
  play: 'M5 3l8 5-8 5z',
  maximise: 'M3 6V3h3M10 3h3v3M13 10v3h-3M6 13H3v-3',
  restore: 'M6 3v3H3M13 6h-3V3M10 13v-3h3M3 10h3v3',
  fit: 'M2.5 2.5h11v11h-11zM8 5v6M5 8h6',
  save: 'M8 2v8M4.5 7L8 10.5 11.5 7M3 13.5h10',
  folder: 'M1.5 12.5v-9H6l1.5 2h7v7z',
  copy: 'M5.5 5.5h8v8h-8zM10.5 5.5v-3h-8v8h3',
  theme: 'M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11',
  inside: 'M8 2.2a5.8 5.8 0 1 0 0 11.6A5.8 5.8 0 0 0 8 2.2zM8 5v6M5 8h6',
  outside: 'M8 2.2a5.8 5.8 0 1 0 0 11.6A5.8 5.8 0 0 0 8 2.2zM5 8h6',
  look: 'M7 2.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM10.3 10.3L14 14',
} as const;
export type Icon = keyof typeof ICONS;

export function icon(name: Icon): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('aria-hidden', 'true');
  svg.setAttribute('class', 'icon');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', ICONS[name]);
  svg.append(path);
  return svg;
}

/** A button that shows an icon only; the words are its label and tooltip. */
export function iconButton(name: Icon, words: string, onclick: (event: MouseEvent) => void,
                           attributes: Attributes = {}): HTMLButtonElement {
  return h('button', { type: 'button', class: 'icon-button', title: words, 'aria-label': words, onclick, ...attributes },
    icon(name));
}

/**
 * Replaces what a container holds; the element with the focus keeps it (found again by its data-key), and a text field that is being
 * edited keeps its text.
 */
export function refill(container: HTMLElement, ...children: Child[]): void {
  const focused = document.activeElement instanceof HTMLElement && container.contains(document.activeElement)
    ? document.activeElement : null;
  const key = focused?.dataset.key;
  const text = focused instanceof HTMLInputElement && (focused.type === 'text' || focused.type === 'number')
    ? { value: focused.value, start: focused.type === 'text' ? focused.selectionStart : null } : null;
  const scroll = container.scrollTop;
  container.replaceChildren(...children.filter((c): c is Node | string => c !== null && c !== undefined && c !== false)
    .map((c) => (typeof c === 'number' ? String(c) : c)));
  container.scrollTop = scroll;
  if (!key) return;
  const again = container.querySelector<HTMLElement>(`[data-key="${CSS.escape(key)}"]`);
  again?.focus({ preventScroll: true });
  if (again instanceof HTMLInputElement && text) {
    again.value = text.value;
    if (text.start !== null) again.setSelectionRange(text.start, text.start);
  }
}

/** A number for people: about three digits that count. */
export function number(value: number | null | undefined, digits = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 1000) return Math.round(value).toLocaleString('en-US');
  const decimals = size === 0 ? 0 : Math.max(0, Math.min(4, digits - 1 - Math.floor(Math.log10(size))));
  return value.toFixed(decimals);
}

/** A volume, small ones in mm3: `28.3 ± 0.4 ml`. */
export function millilitres(ml: number, deviation?: number | null, digits = 3): string {
  const [scale, unit] = Math.abs(ml) < 0.1 ? [1000, 'mm³'] : [1, 'ml'];
  return `${number(scale * ml, digits)}${deviation ? ` ± ${number(scale * deviation, 2)}` : ''} ${unit}`;
}
