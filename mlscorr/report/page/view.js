// a stage on which clouds are turned, moved and zoomed: drawn by WebGL, or where there is none by a z-buffer of our own
// clouds: { before, after (Float32Array, m), colours (Uint8Array), size (m), most (px), home (whether it is part of all), shown }
// over(pen, tools) draws lines and names on top
function turnable(stage, clouds, over, home) {
  let [canvas, marks] = stage.querySelectorAll("canvas");
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const FIELD = 0.9; // rad, height of the view
  let share = 0, dirty = false, gl = null, program, places, ratio = 1, centre, distance, azimuth, elevation, camera;

  // ---- the camera: from a distance towards a centre, all in m and rad

  const everything = () => { // places that are part of all, thinned where there are many
    const arrays = clouds.filter(cloud => cloud.home).map(cloud => cloud.after).concat(home || []), all = [];
    const step = Math.ceil(arrays.reduce((sum, array) => sum + array.length, 0) / 3 / 50000) || 1;
    for (const array of arrays) for (let k = 0; k < array.length; k += 3 * step) all.push([array[k], array[k + 1], array[k + 2]]);
    return all;
  };
  const all = everything();
  function percentile(axis, part) {
    const sorted = Float32Array.from(all, place => place[axis]).sort();
    return sorted[Math.floor(part * (sorted.length - 1))];
  }
  const middle = [0, 1, 2].map(axis => (percentile(axis, 0.01) + percentile(axis, 0.99)) / 2);
  function goTo(place, from) { // a place from an azimuth and 4 m, or all
    centre = place ? [...place] : middle;
    elevation = place ? 0.5 : 0.9;
    azimuth = place ? from : 0;
    look();
    distance = place ? 4 : farEnough();
    redraw();
  }
  function farEnough() { // to see all, but for one point in a thousand, as the camera looks now
    const shape = stage.clientHeight / stage.clientWidth;
    const needed = Float32Array.from(all, place => {
      const d = centre.map((v, c) => place[c] - v);
      const beside = Math.max(shape * Math.abs(dot(camera.right, d)), Math.abs(dot(camera.up, d)));
      return beside / Math.tan(FIELD / 2) - dot(camera.away, d);
    }).sort();
    return 1.05 * Math.max(needed[Math.floor(0.999 * (needed.length - 1))], 5);
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
  const seen = () => clouds.filter(cloud => cloud.shown !== false && cloud.after.length);

  // ---- points by WebGL

  function load(buffer, data) { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW); return buffer; }
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
    places = ["before", "after", "colour"].map(name => gl.getAttribLocation(program, name));
    for (const place of places) gl.enableVertexAttribArray(place);
    for (const cloud of clouds) {
      const before = load(gl.createBuffer(), cloud.before);
      cloud.buffers = [before, cloud.after === cloud.before ? before : load(gl.createBuffer(), cloud.after), load(gl.createBuffer(), cloud.colours)];
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
    for (const cloud of seen()) {
      set("size", cloud.size); set("most", cloud.most * ratio);
      places.forEach((place, k) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, cloud.buffers[k]);
        gl.vertexAttribPointer(place, 3, k < 2 ? gl.FLOAT : gl.UNSIGNED_BYTE, k === 2, 0, 0);
      });
      gl.drawArrays(gl.POINTS, 0, cloud.after.length / 3);
    }
  }

  // ---- points by a z-buffer

  function byHand() {
    const { width, height } = camera, pen = canvas.getContext("2d"), image = pen.createImageData(width, height);
    const depth = new Float32Array(width * height).fill(Infinity), pixels = new Uint32Array(image.data.buffer).fill(0xffffffff);
    for (const { before, after, colours, size, most } of seen()) for (let k = 0; k < after.length; k += 3) {
      const at = project([mix(before, after, k), mix(before, after, k + 1), mix(before, after, k + 2)]);
      if (!at) continue;
      const side = Math.round(Math.min(Math.max(size * camera.scale / at[2], 1.6), most * ratio));
      const left = Math.round(at[0] - side / 2), top = Math.round(at[1] - side / 2);
      const value = 0xff000000 | colours[k + 2] << 16 | colours[k + 1] << 8 | colours[k];
      for (let row = Math.max(top, 0); row < Math.min(top + side, height); row++) for (let column = Math.max(left, 0); column < Math.min(left + side, width); column++) {
        const place = row * width + column;
        if (at[2] < depth[place]) { depth[place] = at[2]; pixels[place] = value; }
      }
    }
    pen.putImageData(image, 0, 0);
  }

  // ---- lines and names, scale bar and north over the points

  const mix = (a, b, k) => a[k] + share * (b[k] - a[k]);
  function overlay() {
    const pen = marks.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0); pen.clearRect(0, 0, marks.width, marks.height);
    pen.lineWidth = 2 * ratio; pen.font = `${13 * ratio}px system-ui, sans-serif`;
    over(pen, { project, mix, words, ratio });
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
  start(); goTo(null);
  new ResizeObserver(redraw).observe(stage);
  return {
    goTo, redraw,
    recolour(cloud) { if (gl) load(cloud.buffers[2], cloud.colours); redraw(); },
    morph(to) { // from before (0) to after (1), within half a second
      const from = share, begin = performance.now(), length = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 500;
      const step = () => { const part = Math.min(1, (performance.now() - begin) / length); share = from + part * (to - from); draw(); if (part < 1) requestAnimationFrame(step); };
      requestAnimationFrame(step);
    },
  };
}
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)), floats = text => new Float32Array(bytes(text).buffer);
