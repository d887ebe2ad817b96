// The one line of an error, and short notices, each at its place for screen readers.
import { byId, h, icon } from './dom';

export const GRAPHICS_LOST = 'The browser has lost its graphics, and the views are empty: reload the page; nothing of the work is lost.';

export function showError(text: string): void {
  const region = byId('alerts');
  const same = [...region.children].find((c) => c.querySelector('.text')?.textContent === text);
  same?.remove();
  const alert = h('div', { class: 'alert', role: 'alert' }, h('span', { class: 'text' }, text),
    h('button', { type: 'button', class: 'icon-button', 'aria-label': 'Dismiss', title: 'Dismiss', onclick: () => alert.remove() },
      icon('cross')));
  region.append(alert);
  while (region.children.length > 4) region.firstElementChild?.remove();
}

let timer = 0;
export function showNotice(text: string): void {
  const region = byId('notice');
  region.textContent = text;
  region.hidden = false;
  clearTimeout(timer);
  timer = window.setTimeout(() => { region.hidden = true; region.textContent = ''; }, 5000);
}
