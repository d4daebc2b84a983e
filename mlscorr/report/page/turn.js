// the cloud in 3D: drawn by WebGL, or where there is none by a z-buffer of our own
(() => {
  const view = document.querySelector(".turn");
  view.hidden = false;
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const stage = view.querySelector(".stage");
  let [canvas, marks] = stage.querySelectorAll("canvas");
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const floats = text => new Float32Array(bytes(text).buffer);
  const before = floats(scene.before), after = floats(scene.after), count = before.length / 3;
  const track = scene.trajectory.map(floats);
  const values = { intensity: bytes(scene.intensity), height: bytes(scene.height) };
  const tables = { intensity: bytes(scene.colours.intensity), height: bytes(scene.colours.height) };
  const colours = new Uint8Array(3 * count);
  const mix = (a, b, k) => a[k] + share * (b[k] - a[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const FIELD = 0.9, SMALLEST = 0.04; // rad, height of the view; m, size of a point near a target
  let share = 0, colour = "intensity", dirty = false, gl = null, program, buffers;
  let centre, distance, azimuth, elevation, camera;

  function paint() {
    const value = values[colour], table = tables[colour];
    for (let k = 0; k < count; k++) for (let c = 0; c < 3; c++) colours[3 * k + c] = table[3 * value[k] + c];
    if (gl) load(buffers.colour, colours);
  }

  // ---- the camera: from a distance towards a centre, all in m and rad

  const low = [0, 1, 2].map(a => percentile(a, 0.01)), high = [0, 1, 2].map(a => percentile(a, 0.99));
  function percentile(axis, part) {
    const sorted = Float32Array.from({ length: scene.even }, (_, k) => after[3 * k + axis]).sort();
    return sorted[Math.floor(part * (scene.even - 1))];
  }
  function goTo(target) {
    centre = target ? [...target.surveyed] : low.map((v, k) => (v + high[k]) / 2);
    elevation = target ? 0.5 : 0.9;
    azimuth = target ? facing(target) : 0;
    look();
    distance = target ? 4 : farEnough();
    redraw();
  }
  function farEnough() { // to see the cloud, but for one point in a thousand, as the camera looks now
    const shape = stage.clientHeight / stage.clientWidth, needed = new Float32Array(scene.even);
    for (let k = 0; k < scene.even; k++) {
      const d = centre.map((v, c) => after[3 * k + c] - v);
      const beside = Math.max(shape * Math.abs(dot(camera.right, d)), Math.abs(dot(camera.up, d)));
      needed[k] = beside / Math.tan(FIELD / 2) - dot(camera.away, d);
    }
    return 1.05 * Math.max(needed.sort()[Math.floor(0.999 * (scene.even - 1))], 5);
  }
  function facing(target) { // look at a target from the nearest place of the trajectory
    let best = Infinity, found = 0;
    for (let k = 0; k < track[1].length; k += 3) {
      const east = target.surveyed[0] - track[1][k], north = target.surveyed[1] - track[1][k + 1];
      if (Math.hypot(east, north) < best) [best, found] = [Math.hypot(east, north), Math.atan2(east, north)];
    }
    return found;
  }
  function look() {
    const [sa, ca, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    const right = [ca, -sa, 0], away = [sa * ce, ca * ce, -se], up = [sa * se, ca * se, ce];
    const [width, height] = [canvas.width, canvas.height];
    camera = { right, up, away, width, height, scale: height / 2 / Math.tan(FIELD / 2) };
  }
  function project(p) { // column, row, depth; null behind the eye
    const d = [p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]];
    const z = dot(camera.away, d) + distance;
    if (!(z > distance / 100)) return null;
    return [camera.width / 2 + camera.scale * dot(camera.right, d) / z, camera.height / 2 - camera.scale * dot(camera.up, d) / z, z];
  }

  // ---- points by WebGL

  function load(buffer, data) { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW); }
  function start() {
    gl = canvas.getContext("webgl", { antialias: false });
    if (!gl) return;
    canvas.addEventListener("webglcontextlost", byHandFromNow);
    program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, `
      attribute vec3 before, after, colour; uniform float share, near, scale, size, height, most; uniform vec3 centre, right, up, away; uniform vec2 lens; uniform float distance; varying vec3 shade;
      void main() {
        vec3 d = mix(before, after, share) - centre;
        float z = dot(away, d) + distance, far = 1e5 * near;
        gl_Position = vec4(lens.x * dot(right, d), lens.y * dot(up, d), z * (far + near) / (far - near) - 2.0 * far * near / (far - near), z);
        gl_PointSize = clamp(size * scale / z, 1.6, most); shade = colour;
      }`], [gl.FRAGMENT_SHADER, "precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }"]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return byHandFromNow();
    gl.useProgram(program); gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);
    buffers = { before: gl.createBuffer(), after: gl.createBuffer(), colour: gl.createBuffer() };
    load(buffers.before, before); load(buffers.after, after);
    for (const [name, type] of [["before", gl.FLOAT], ["after", gl.FLOAT], ["colour", gl.UNSIGNED_BYTE]]) {
      const place = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, type, type === gl.UNSIGNED_BYTE, 0, 0);
    }
  }
  function byHandFromNow() { // a canvas keeps its first kind of context, so it needs another one
    const other = canvas.cloneNode();
    canvas.replaceWith(other); [canvas, gl] = [other, null]; redraw();
  }
  function byWebGL() {
    const set = (name, ...v) => gl["uniform" + v.length + "f"](gl.getUniformLocation(program, name), ...v);
    const { right, up, away, width, height, scale } = camera, lens = 1 / Math.tan(FIELD / 2);
    gl.viewport(0, 0, width, height); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    set("share", share); set("near", distance / 100); set("scale", scale); set("distance", distance);
    set("centre", ...centre); set("right", ...right); set("up", ...up); set("away", ...away);
    set("lens", lens * height / width, lens);
    for (const [first, number, size, most] of parts()) { set("size", size); set("most", most); if (number) gl.drawArrays(gl.POINTS, first, number); }
  }
  const parts = () => [[0, scene.even, 0.6 * scene.spacing, 5 * ratio], [scene.even, count - scene.even, SMALLEST, 9 * ratio]];

  // ---- points by a z-buffer

  function byHand() {
    const { width, height } = camera, pen = canvas.getContext("2d"), image = pen.createImageData(width, height);
    const depth = new Float32Array(width * height).fill(Infinity), pixels = new Uint32Array(image.data.buffer).fill(0xffffffff);
    for (const [first, number, size, most] of parts()) for (let k = first; k < first + number; k++) {
      const at = project([mix(before, after, 3 * k), mix(before, after, 3 * k + 1), mix(before, after, 3 * k + 2)]);
      if (!at) continue;
      const side = Math.round(Math.min(Math.max(size * camera.scale / at[2], 1.6), most));
      const left = Math.round(at[0] - side / 2), top = Math.round(at[1] - side / 2);
      const value = 0xff000000 | colours[3 * k + 2] << 16 | colours[3 * k + 1] << 8 | colours[3 * k];
      for (let row = Math.max(top, 0); row < Math.min(top + side, height); row++) for (let column = Math.max(left, 0); column < Math.min(left + side, width); column++) {
        const place = row * width + column;
        if (at[2] < depth[place]) { depth[place] = at[2]; pixels[place] = value; }
      }
    }
    pen.putImageData(image, 0, 0);
  }

  // ---- trajectory, targets, scale bar and north over the points

  let ratio = 1;
  function overlay() {
    const pen = marks.getContext("2d"), mark = getComputedStyle(view.querySelector(".ring")).borderTopColor;
    pen.setTransform(1, 0, 0, 1, 0, 0); pen.clearRect(0, 0, marks.width, marks.height);
    pen.lineWidth = 2 * ratio; pen.font = `${13 * ratio}px system-ui, sans-serif`;
    const line = places => { pen.beginPath(); let down = false; for (const p of places) { const at = project(p); if (at) pen[down ? "lineTo" : "moveTo"](at[0], at[1]); down = !!at; } };
    const path = Array.from({ length: track[0].length / 3 }, (_, k) => [0, 1, 2].map(c => mix(track[0], track[1], 3 * k + c)));
    pen.strokeStyle = "#d55e00"; line(path); pen.stroke();
    const taken = [];
    for (const target of scene.targets) {
      const at = project(target.surveyed);
      if (!at) continue;
      if (target.scanned) {
        line([target.surveyed, [0, 1, 2].map(c => mix(target.scanned[0], target.scanned[1], c))]);
        pen.strokeStyle = "#fff"; pen.lineWidth = 5 * ratio; pen.stroke(); pen.strokeStyle = mark; pen.lineWidth = 2.5 * ratio; pen.stroke();
      }
      pen.beginPath(); pen.arc(at[0], at[1], 5 * ratio, 0, 7); pen.strokeStyle = mark; pen.lineWidth = 2 * ratio; pen.stroke();
      const box = [at[0] + 9 * ratio, at[1], pen.measureText(target.name).width, 15 * ratio];
      if (taken.some(b => Math.abs(b[1] - box[1]) < box[3] && box[0] < b[0] + b[2] && b[0] < box[0] + box[2])) continue;
      taken.push(box); words(pen, target.name, box[0], box[1]);
    }
    legend(pen);
  }
  function words(pen, text, x, y) {
    pen.textBaseline = "middle"; pen.lineWidth = 4 * ratio; pen.strokeStyle = "#ffffffe0"; pen.lineJoin = "round";
    pen.strokeText(text, x, y); pen.fillStyle = "#111"; pen.fillText(text, x, y);
  }
  function legend(pen) {
    const metre = camera.scale / distance, widest = Math.min(160 * ratio, camera.width / 3) / metre, power = 10 ** Math.floor(Math.log10(widest));
    const length = power * [5, 2, 1].find(step => step * power <= widest), foot = camera.height - 14 * ratio;
    pen.fillStyle = "#111"; pen.fillRect(14 * ratio, foot, length * metre, 4 * ratio);
    words(pen, `${+length.toPrecision(1)} m`, 14 * ratio, foot - 13 * ratio);
    const arm = 26 * ratio, x = camera.width - 44 * ratio, y = 44 * ratio;
    const tip = [x + arm * camera.right[1], y - arm * camera.up[1]];
    pen.strokeStyle = "#111"; pen.lineWidth = 2 * ratio; pen.beginPath(); pen.moveTo(x, y); pen.lineTo(...tip); pen.stroke();
    words(pen, "N", tip[0] + 6 * ratio * camera.right[1] - 4 * ratio, tip[1] - 10 * ratio * camera.up[1]);
  }

  function draw() {
    dirty = false;
    ratio = Math.min(devicePixelRatio || 1, 2);
    const size = [stage.clientWidth, stage.clientHeight].map(v => Math.max(1, Math.round(v * ratio)));
    for (const c of [canvas, marks]) if (c.width !== size[0] || c.height !== size[1]) [c.width, c.height] = size;
    look(); (gl ? byWebGL : byHand)(); overlay();
    stage.dataset.drawn = gl ? "webgl" : "canvas"; stage.dataset.share = share;
  }
  function redraw() { if (!dirty) { dirty = true; requestAnimationFrame(draw); } }

  // ---- what the user does

  const turn = (dx, dy) => { azimuth += dx * 0.006; elevation = Math.min(1.57, Math.max(-0.3, elevation + dy * 0.006)); redraw(); };
  const zoom = factor => { distance = Math.min(2e4, Math.max(0.5, distance * factor)); redraw(); };
  const pan = (dx, dy) => { const m = distance / camera.scale * ratio; centre = centre.map((v, k) => v - m * dx * camera.right[k] + m * dy * camera.up[k]); redraw(); };
  const fingers = new Map();
  stage.addEventListener("pointerdown", e => { stage.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); });
  for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, e => fingers.delete(e.pointerId));
  stage.addEventListener("pointermove", e => {
    const old = fingers.get(e.pointerId), now = [e.clientX, e.clientY];
    if (!old) return;
    const [dx, dy] = [now[0] - old[0], now[1] - old[1]];
    if (fingers.size === 1) (e.shiftKey || e.buttons > 1 ? pan : turn)(dx, dy);
    else {
      const other = [...fingers].find(([id]) => id !== e.pointerId)[1], span = p => Math.hypot(p[0] - other[0], p[1] - other[1]) + 1;
      zoom(span(old) / span(now)); pan(dx / 2, dy / 2);
    }
    fingers.set(e.pointerId, now);
  });
  stage.addEventListener("contextmenu", e => e.preventDefault());
  stage.addEventListener("wheel", e => { // the page scrolls until the picture was chosen by a click
    if (document.activeElement !== stage && !e.ctrlKey) return;
    e.preventDefault(); zoom(Math.exp(Math.sign(e.deltaY) * Math.min(Math.abs(e.deltaY), 100) * 0.0015));
  }, { passive: false });
  stage.addEventListener("keydown", e => {
    const go = e.shiftKey ? (dx, dy) => pan(3 * dx, 3 * dy) : turn;
    const act = { ArrowLeft: () => go(-15, 0), ArrowRight: () => go(15, 0), ArrowUp: () => go(0, 15), ArrowDown: () => go(0, -15), "+": () => zoom(0.8), "=": () => zoom(0.8), "-": () => zoom(1.25), Home: () => goTo(null) }[e.key];
    if (act && !e.ctrlKey) { e.preventDefault(); act(); }
  });
  for (const input of view.querySelectorAll("input")) input.addEventListener("change", () => {
    if (input.name === "colour") { colour = input.value; paint(); redraw(); return; }
    const from = share, to = Number(input.value), start = performance.now(), length = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 500;
    const step = () => { const part = Math.min(1, (performance.now() - start) / length); share = from + part * (to - from); draw(); if (part < 1) requestAnimationFrame(step); };
    requestAnimationFrame(step);
  });
  const choice = view.querySelector("select"), named = new Map(scene.targets.map(target => [target.name, target]));
  for (const name of [...named.keys()].sort((a, b) => a.localeCompare(b, "en", { numeric: true }))) choice.append(new Option(name, name));
  choice.addEventListener("change", () => goTo(named.get(choice.value)));
  start(); paint(); goTo(null);
  new ResizeObserver(redraw).observe(stage);
})();
