'use strict';
(() => {
  const { metrics, rows, limit } = JSON.parse(document.getElementById('data').textContent);
  const at = (id) => document.getElementById(id);
  const ratings = ['no rating', 'good', 'to check', 'bad'];
  const storageKey = 'surfseg batch ' + location.pathname;

  /** An element with attributes (functions are listeners) and children; text is never markup. */
  const make = (tag, attributes = {}, ...children) => {
    const svg = ['svg', 'circle', 'line', 'rect', 'text', 'title'].includes(tag);
    const out = svg ? document.createElementNS('http://www.w3.org/2000/svg', tag) : document.createElement(tag);
    for (const [key, value] of Object.entries(attributes))
      if (typeof value === 'function') out.addEventListener(key, value);
      else if (value !== false && value !== undefined) out.setAttribute(key, value === true ? '' : value);
    out.append(...children);
    return out;
  };
  const link = (file) => file.split('/').map(encodeURIComponent).join('/');
  const idOf = (row) => row.object ? row.name + '/' + row.object : row.name;
  const fileOf = (row, ending) => row.files.find((file) => file.endsWith(ending));
  const kindOf = (row) => row.state === 'failed' ? 'failed' : row.state === 'not run' ? 'missing'
    : row.outlier.length ? 'outlier' : row.state === 'done' ? 'done' : 'limit';
  const stateOf = (row) => row.outlier.length && row.state !== 'failed' ? 'outlier' : row.state;
  const shown = (value, unit) => value === null ? '–' : String(Number(value.toPrecision(4))) + (unit ? ' ' + unit : '');

  let rated = {};
  try { rated = JSON.parse(localStorage.getItem(storageKey)) || {}; } catch { /* kept in this page alone */ }
  const rate = (row, rating) => {
    if (rating) rated[idOf(row)] = rating; else delete rated[idOf(row)];
    try { localStorage.setItem(storageKey, JSON.stringify(rated)); } catch { /* as above */ }
    row.rating.textContent = rated[idOf(row)] ? ratings[rated[idOf(row)]] : '';
    open(row);
  };

  let visible = rows, current = null;
  const dialog = at('case');
  const step = (by) => {
    const next = visible[visible.indexOf(current) + by];
    if (next) open(next);
  };

  const numbers = (row) => make('table', {},
    make('tr', {}, ...['', 'value', 'robust z'].map((text) => make('th', { scope: 'col' }, text))),
    ...metrics.map((metric, m) => make('tr', { title: metric.about }, make('th', { scope: 'row' }, metric.title),
      make('td', {}, shown(row.x[m], metric.unit)),
      make('td', { class: metric.judged && Math.abs(row.z[m]) > limit && 'far' }, shown(row.z[m], '')))));

  function open(row) {
    if (current) for (const dot of current.dots) dot.classList.remove('now');
    current = row;
    for (const dot of row.dots) dot.classList.add('now');
    const picture = fileOf(row, '_slices.png');
    const buttons = ratings.map((text, n) => make('button', {
      type: 'button', 'aria-pressed': String((rated[idOf(row)] || 0) === n), click: () => rate(row, n),
    }, `${n} ${text}`));
    dialog.replaceChildren(
      make('h2', { id: 'title' }, `${row.name} ${row.object}`, make('span', { class: 'state' }, stateOf(row))),
      ...(picture ? [make('img', { src: link(picture), alt: `Slices of ${row.name} with the outline` })] : []),
      make('nav', {}, make('button', { type: 'button', click: () => step(-1) }, '← previous'),
        make('button', { type: 'button', click: () => step(1) }, 'next →'), make('span', { class: 'gap' }), ...buttons,
        make('span', { class: 'gap' }), make('button', { type: 'button', click: () => dialog.close() }, 'close')),
      make('p', {}, [row.message, row.verdict && 'verdict: ' + row.verdict, row.code && 'exit code ' + row.code,
        row.outlier.length && 'outlier in ' + row.outlier.join(', '), 'scan: ' + row.scan].filter(Boolean).join(' · ')),
      numbers(row),
      ...(fileOf(row, '_report.html') ? [make('p', {}, make('a', { class: 'report', href: link(fileOf(row, '_report.html')) }, 'Report of this case'))] : []),
      make('ul', { class: 'files' }, ...row.files.map((file) => make('li', {}, make('a', { href: link(file) }, file)))));
    if (!dialog.open) dialog.showModal();
    dialog.focus();  // the button that had it is gone
    history.replaceState(null, '', '#' + encodeURIComponent(idOf(row)));
  }
  dialog.addEventListener('close', () => {
    history.replaceState(null, '', location.pathname);
    if (current) current.card.focus();
  });
  document.addEventListener('keydown', (event) => {
    if (!dialog.open || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === 'ArrowLeft') step(-1);
    else if (event.key === 'ArrowRight') step(1);
    else if ('0123'.includes(event.key)) rate(current, Number(event.key));
    else return;
    event.preventDefault();
  });

  for (const row of rows) {
    row.dots = [];
    row.rating = make('span', { class: 'rating' }, ratings[rated[idOf(row)]] || '');
    const thumbnail = fileOf(row, '_thumbnail.png');
    const what = row.state === 'failed' ? row.message : row.outlier.length
      ? row.outlier.map((key) => {
        const m = metrics.findIndex((metric) => metric.key === key);
        return `${metrics[m].title} ${shown(row.x[m], metrics[m].unit)}, z ${shown(row.z[m], '')}`;
      }).join('; ')
      : [shown(row.x[0], metrics[0].unit), row.verdict].filter((text) => text && text !== '–').join(', ');
    row.card = make('button', { type: 'button', class: 'card ' + kindOf(row), click: () => open(row) },
      ...(thumbnail ? [make('img', { src: link(thumbnail), alt: '', loading: 'lazy', decoding: 'async', width: 480, height: 160 })] : []),
      make('span', { class: 'state' }, stateOf(row)), row.rating,
      make('span', { class: 'name' }, `${row.name} ${row.object}`), make('span', { class: 'message' }, what));
    row.item = make('li', {}, row.card);
  }

  /** Dots spread a little up and down, the same at every visit. */
  const strip = (metric, m, object) => {
    const known = rows.filter((row) => row.object === object && row.x[m] !== null);
    const sorted = known.map((row) => row.x[m]).sort((a, b) => a - b);
    const low = sorted[0], high = sorted[sorted.length - 1];
    if (!(high > low)) return [];  // nothing to compare
    const x = (value) => 12 + 376 * (value - low) / (high - low);
    const quartile = (share) => sorted[Math.round(share * (sorted.length - 1))];
    const dots = known.map((row, n) => {
      const dot = make('circle', {
        cx: x(row.x[m]), cy: 31 + 22 * (((n * 0.618034) % 1) - 0.5) * 2, r: 4, class: row.outlier.includes(metric.key) && 'outlier',
      }, make('title', {}, `${row.name} ${row.object}: ${shown(row.x[m], metric.unit)}`));
      row.dots.push(dot);
      const report = fileOf(row, '_report.html');
      if (!report) {
        dot.addEventListener('click', () => open(row));
        return dot;
      }
      const anchor = document.createElementNS('http://www.w3.org/2000/svg', 'a');
      anchor.setAttribute('href', link(report));
      anchor.setAttribute('tabindex', '-1');  // the cards have the way by keyboard
      anchor.append(dot);
      return anchor;
    });
    const from = x(quartile(0.25)), to = x(quartile(0.75));
    return [make('figure', {}, make('figcaption', {}, object ? `${metric.title}, ${object}` : metric.title, make('span', {}, 'median ' + shown(quartile(0.5), metric.unit))),
      make('svg', { viewBox: '0 0 400 74', role: 'img', 'aria-label': metric.about },
        make('rect', { class: 'box', x: from, y: 4, width: Math.max(1, to - from), height: 54, rx: 3 }),
        make('line', { class: 'box', x1: x(quartile(0.5)), x2: x(quartile(0.5)), y1: 4, y2: 58 }), ...dots,
        make('text', { x: 4, y: 71 }, shown(low, metric.unit)),
        make('text', { x: 396, y: 71, 'text-anchor': 'end' }, shown(high, metric.unit))))];
  };

  const kinds = { all: 'all', failed: 'failed', outlier: 'outlier', limit: 'stopped at a limit', done: 'done', missing: 'not run', unrated: 'without a rating' };
  const order = () => {
    const words = at('find').value.toLowerCase(), show = at('show').value, key = at('sort').value;
    visible = rows.filter((row) => (show === 'all' || (show === 'unrated' ? !rated[idOf(row)] : kindOf(row) === show))
      && `${row.name} ${row.object} ${row.message} ${row.scan}`.toLowerCase().includes(words));
    const m = metrics.findIndex((metric) => metric.key === key);
    const value = (row) => row.x[m] === null ? -Infinity : row.x[m];
    if (m >= 0) visible.sort((a, b) => value(a) < value(b) ? 1 : value(a) > value(b) ? -1 : 0);
    if (key === 'name') visible.sort((a, b) => a.name < b.name ? -1 : a.name > b.name ? 1 : 0);
    at('cases').replaceChildren(...visible.map((row) => row.item));
  };

  const save = () => {
    const lines = rows.filter((row) => rated[idOf(row)]).map((row) => [row.name, row.object || 'n/a', rated[idOf(row)], ratings[rated[idOf(row)]]].join('\t'));
    const table = ['name\tobject\trating\tmeaning', ...lines, ''].join('\n');
    make('a', { download: 'ratings.tsv', href: 'data:text/tab-separated-values;charset=utf-8,' + encodeURIComponent(table) }).click();
  };

  at('counts').textContent = Object.keys(kinds).slice(1, -1).map((kind) => [rows.filter((row) => kindOf(row) === kind).length, kinds[kind]])
    .filter(([n]) => n).map(([n, words]) => `${n} ${words}`).join(', ');
  for (const [kind, words] of Object.entries(kinds)) at('show').append(make('option', { value: kind }, words));
  for (const [key, words] of [['', 'failures, outliers first'], ['name', 'name'], ...metrics.map((metric) => [metric.key, metric.title])])
    at('sort').append(make('option', { value: key }, words));
  at('tools').hidden = false;
  at('tools').addEventListener('submit', (event) => event.preventDefault());
  for (const id of ['find', 'show', 'sort']) at(id).addEventListener('input', order);
  at('export').addEventListener('click', save);
  const objects = [...new Set(rows.map((row) => row.object))];
  at('strips').append(...metrics.flatMap((metric, m) => objects.flatMap((object) => strip(metric, m, object))));
  at('failures').append(...rows.filter((row) => row.state === 'failed').map((row) => make('li', {},
    make('button', { type: 'button', click: () => open(row) }, `${row.name} ${row.object}`), ` exit code ${row.code}: ${row.message}`)));
  order();
  const asked = rows.find((row) => '#' + encodeURIComponent(idOf(row)) === location.hash);
  if (asked) open(asked);
})();
