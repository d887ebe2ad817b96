// Builds dist/: the page in four files that load nothing from elsewhere.
import { build } from 'esbuild';
import { copyFileSync, existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

process.chdir(dirname(fileURLToPath(import.meta.url)));
rmSync('dist', { recursive: true, force: true });
mkdirSync('dist');

const result = await build({
  entryPoints: ['src/main.ts'], outfile: 'dist/studio.js', bundle: true, format: 'esm', minify: true, target: 'es2022',
  legalComments: 'none', charset: 'utf8', metafile: true, logLevel: 'warning',
  // NiiVue's reader of Zarr, which the page never meets, would bring a third of its size in codecs.
  alias: { zarrita: './src/no_zarr.ts' },
});
copyFileSync('src/index.html', 'dist/index.html');
copyFileSync('src/studio.css', 'dist/studio.css');

// The licence of every package of which something is in the bundle.
const packages = [...new Set(Object.keys(result.metafile.inputs)
  .map((path) => /^node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]).filter(Boolean))].sort();
const texts = packages.map((name) => {
  const folder = join('node_modules', name);
  const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = readdirSync(folder).find((f) => /^licen[cs]e/i.test(f));
  const own = join('licences', `${name.split('/').pop()}.txt`);  // NiiVue's package lacks its licence
  if (!file && !existsSync(own)) throw new Error(`no licence text of ${name}`);
  const text = readFileSync(file ? join(folder, file) : own, 'utf8').trim();
  return `${name} ${about.version} (${about.license})\n${'='.repeat(72)}\n${text}\n`;
});
writeFileSync('dist/licences.txt', `The page of surfseg studio is part of surfseg (GPL-3.0-or-later) and contains:\n\n${texts.join('\n\n')}`);
console.log(readdirSync('dist').map((f) => `dist/${f}  ${(readFileSync(join('dist', f)).length / 1000).toFixed(0)} kB`).join('\n'));
console.log(`licences: ${packages.join(', ')}`);
