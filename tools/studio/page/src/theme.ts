// Dark or light: as the system has it, until the person chooses.
import { byId } from './dom';
import { remember, remembered } from './state';

const system = matchMedia('(prefers-color-scheme: light)');
function current(): 'dark' | 'light' {
  const chosen = remembered('theme');
  return chosen === 'dark' || chosen === 'light' ? chosen : system.matches ? 'light' : 'dark';
}
function show(): void { document.documentElement.dataset.theme = current(); }

export function startTheme(): void {
  show();
  system.addEventListener('change', show);
  byId('theme').addEventListener('click', switchTheme);
}
export function switchTheme(): void {
  remember('theme', current() === 'dark' ? 'light' : 'dark');
  show();
}
