'use strict';
// The viewer of a report: surfaces by WebGL 2, turned by hand. Nothing is loaded from elsewhere.
(() => {
  const objects = JSON.parse(document.getElementById('scene').textContent);
  if (!objects) return;
  const canvas = document.getElementById('solid'), tools = document.getElementById('tools');
  const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return;
  document.getElementById('viewer').hidden = false;
  document.getElementById('no-viewer').hidden = true;

  const VERTEX = `#version 300 es
    uniform mat4 place; uniform mat3 turn;
    in vec3 point; in vec3 normal; in vec3 colour; out vec3 n; out vec3 c;
    void main() { n = turn * normal; c = colour; gl_PointSize = 11.0; gl_Position = place * vec4(point, 1.0); }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    uniform bool isClick; in vec3 n; in vec3 c; out vec4 result;
    void main() {
      if (isClick) {
        float r = length(gl_PointCoord - 0.5);
        if (r > 0.5) discard;
        result = vec4(r > 0.36 ? vec3(0.0) : c, 1.0);
        return;
      }
      vec3 m = normalize(n);
      if (!gl_FrontFacing) m = -m;
      float lamp = max(dot(m, normalize(vec3(-0.35, 0.55, 0.75))), 0.0), rim = max(dot(m, normalize(vec3(0.6, -0.3, 0.5))), 0.0);
      result = vec4(c * (0.3 + 0.62 * lamp + 0.14 * rim) + 0.12 * pow(max(dot(m, vec3(-0.2, 0.32, 0.92)), 0.0), 40.0), 1.0);
    }`;
  const program = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  ['point', 'normal', 'colour'].forEach((name, k) => gl.bindAttribLocation(program, k, name));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const uniform = (name) => gl.getUniformLocation(program, name);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  /** Blue to yellow, as the bar shows it: the less sure, the brighter. */
  const ramp = (t) => [0.19 + 0.8 * Math.min(1, 1.5 * t), 0.2 + 0.65 * t * t + 0.25 * (1 - t), 0.55 * (1 - t) + 0.1];
  const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

  const normalsOf = (p, t) => {
    const out = new Float32Array(p.length);
    for (let f = 0; f < t.length; f += 3) {
      const [i, j, k] = [3 * t[f], 3 * t[f + 1], 3 * t[f + 2]];
      const a = [0, 1, 2].map((x) => p[j + x] - p[i + x]), b = [0, 1, 2].map((x) => p[k + x] - p[i + x]);
      const n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      for (const corner of [i, j, k]) for (let x = 0; x < 3; x++) out[corner + x] += n[x];
    }
    return out;
  };
  const attribute = (k, data) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 0, 0);
    return buffer;
  };

  const low = [0, 1, 2].map((k) => Math.min(...objects.map((o) => o.low[k])));
  const high = [0, 1, 2].map((k) => Math.max(...objects.map((o) => o.high[k])));
  const centre = low.map((x, k) => (x + high[k]) / 2);
  const radius = Math.max(1e-3, Math.hypot(...low.map((x, k) => high[k] - x)) / 2);
  for (const o of objects) {
    const steps = new Uint16Array(bytes(o.points).buffer), points = Float32Array.from(steps, (s, n) =>
      o.low[n % 3] + s / 65535 * (o.high[n % 3] - o.low[n % 3]) - centre[n % 3]);
    const triangles = o.bits === 16 ? new Uint16Array(bytes(o.triangles).buffer) : new Uint32Array(bytes(o.triangles).buffer);
    o.n = points.length;
    o.count = triangles.length;
    o.shown = true;
    o.array = gl.createVertexArray();
    gl.bindVertexArray(o.array);
    attribute(0, points);
    attribute(1, normalsOf(points, triangles));
    o.colours = attribute(2, new Float32Array(points.length));
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    o.marks = gl.createVertexArray();
    gl.bindVertexArray(o.marks);
    attribute(0, Float32Array.from(o.clicks.flatMap((c) => c.slice(0, 3).map((x, k) => x - centre[k]))));
    attribute(1, new Float32Array(3 * o.clicks.length));
    attribute(2, Float32Array.from(o.clicks.flatMap((c) => c[3] ? [0.3, 1, 0.4] : [1, 0.4, 0.75])));
    gl.bindVertexArray(null);
    if (o.certainty) {
      o.deviation = bytes(o.certainty.deviation);
      o.edge = bytes(o.certainty.edge);
    }
  }

  const paintColours = (by) => {
    for (const o of objects) {
      const plain = rgb(o.colour), colours = new Float32Array(o.n);
      for (let v = 0; v < o.n / 3; v++)
        colours.set(by === 'deviation' && o.deviation ? ramp(o.deviation[v] / 255)
          : by === 'edge' && o.edge ? (o.edge[v] ? [0.45, 0.62, 0.75] : [0.95, 0.3, 0.2]) : plain, 3 * v);
      gl.bindBuffer(gl.ARRAY_BUFFER, o.colours);
      gl.bufferData(gl.ARRAY_BUFFER, colours, gl.STATIC_DRAW);
    }
  };

  // Columns: where x (right), y (anterior) and z (superior) of the patient go: right, up, towards the eye.
  const LOOK = { Front: [-1, 0, 0, 0, 0, 1, 0, 1, 0], Left: [0, 0, -1, -1, 0, 0, 0, 1, 0], Above: [1, 0, 0, 0, 1, 0, 0, 0, 1] };
  let rotation = LOOK.Front.slice(), zoomed = 1, shift = [0, 0], hasClicks = true, scheduled = false, drag = null;
  const turn = (right, down) => {
    const [a, b, c, d] = [Math.cos(right), Math.sin(right), Math.cos(down), Math.sin(down)];
    for (let k = 0; k < 9; k += 3) {
      const [x, y, z] = rotation.slice(k, k + 3), z1 = -b * x + a * z;
      rotation.splice(k, 3, a * x + b * z, c * y - d * z1, d * y + c * z1);
    }
    draw();
  };
  const zoom = (factor) => { zoomed = Math.max(0.3, Math.min(30, zoomed * factor)); draw(); };

  const letters = [['R', '#ff7b72'], ['A', '#56d364'], ['S', '#79b8ff']].map(([letter, colour]) => {
    const span = document.createElement('span');
    span.textContent = letter;
    span.style.color = colour;
    document.getElementById('axes').append(span);
    return span;
  });

  const paint = () => {
    const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    canvas.width = Math.max(1, Math.round(w * ratio));
    canvas.height = Math.max(1, Math.round(h * ratio));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.082, 0.094, 0.114, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const s = 0.9 * Math.min(w, h) / 2 * zoomed / radius, m = new Float32Array(16);
    for (let k = 0; k < 3; k++)
      m.set([2 * s / w * rotation[3 * k], 2 * s / h * rotation[3 * k + 1], -0.03 / radius * rotation[3 * k + 2]], 4 * k);
    m.set([2 * shift[0] / w, -2 * shift[1] / h, 0, 1], 12);
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniform('place'), false, m);
    gl.uniformMatrix3fv(uniform('turn'), false, new Float32Array(rotation));
    gl.enable(gl.DEPTH_TEST);
    gl.uniform1i(uniform('isClick'), 0);
    for (const o of objects) if (o.shown) {
      gl.bindVertexArray(o.array);
      gl.drawElements(gl.TRIANGLES, o.count, o.bits === 16 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT, 0);
    }
    gl.disable(gl.DEPTH_TEST);
    gl.uniform1i(uniform('isClick'), 1);
    for (const o of objects) if (o.shown && hasClicks && o.clicks.length) {
      gl.bindVertexArray(o.marks);
      gl.drawArrays(gl.POINTS, 0, o.clicks.length);
    }
    gl.bindVertexArray(null);
    letters.forEach((span, k) => {
      span.style.left = `${44 + 26 * rotation[3 * k]}px`;
      span.style.top = `${h - 44 - 26 * rotation[3 * k + 1]}px`;
    });
  };
  const draw = () => {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(() => { scheduled = false; paint(); });
  };

  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    drag = { x: event.clientX, y: event.clientY, moves: event.shiftKey || event.button !== 0 };
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
    drag.x = event.clientX;
    drag.y = event.clientY;
    if (drag.moves) { shift = [shift[0] + dx, shift[1] + dy]; draw(); } else turn(dx / 150, dy / 150);
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { drag = null; });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 500)); }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.15], ArrowDown: [0, 0.15] }[event.key];
    if (step) turn(...step); else if (event.key === '+') zoom(1.15); else if (event.key === '-') zoom(1 / 1.15); else return;
    event.preventDefault();
  });
  window.addEventListener('resize', draw);

  const button = (text, action) => {
    const out = document.createElement('button');
    out.type = 'button';
    out.textContent = text;
    out.addEventListener('click', action);
    tools.append(out);
  };
  const box = (text, colour, change) => {
    const label = document.createElement('label'), input = document.createElement('input');
    input.type = 'checkbox';
    input.checked = true;
    input.addEventListener('input', () => { change(input.checked); draw(); });
    label.append(input, ' ' + text);
    if (colour) label.style.color = colour;
    tools.append(label);
  };
  for (const [name, look] of Object.entries(LOOK))
    button(name, () => { rotation = look.slice(); zoomed = 1; shift = [0, 0]; draw(); });
  if (objects.length > 1) for (const o of objects) box(o.name, o.colour, (on) => { o.shown = on; });
  box('clicks', '', (on) => { hasClicks = on; });
  if (objects.some((o) => o.certainty)) {
    const select = document.createElement('select'), bar = document.createElement('span'), legend = document.createElement('span');
    select.setAttribute('aria-label', 'Colours');
    for (const [value, text] of [['plain', 'plain'], ['deviation', 'by deviation'], ['edge', 'by edge']])
      select.append(new Option(text, value));
    bar.id = 'bar';
    select.addEventListener('input', () => {
      const by = select.value;
      bar.style.background = by === 'deviation'
        ? `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map((t) => `rgb(${ramp(t).map((x) => Math.round(255 * x))})`)})` : 'none';
      legend.textContent = by === 'deviation' ? '0 to ' + objects.filter((o) => o.certainty)
        .map((o) => `${o.certainty.most_mm.toPrecision(3)} mm`).join(', ') : by === 'edge' ? 'red: no edge was found there' : '';
      paintColours(by);
      draw();
    });
    tools.append(select, bar, legend);
  }
  paintColours('plain');
  draw();
})();
