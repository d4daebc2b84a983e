// the cloud of a correction in 3D, before and after, with its trajectory and targets
(() => {
  const view = document.querySelector(".turn");
  view.hidden = false;
  const scene = JSON.parse(document.getElementById("scene").textContent), even = 3 * scene.even;
  const [before, after] = [floats(scene.before), floats(scene.after)], track = scene.trajectory.map(floats);
  const values = { intensity: bytes(scene.intensity), height: bytes(scene.height) };
  const tables = { intensity: bytes(scene.colours.intensity), height: bytes(scene.colours.height) };
  const colours = new Uint8Array(after.length);
  const part = (first, end, rest) => ({ before: before.subarray(first, end), after: after.subarray(first, end), colours: colours.subarray(first, end), ...rest });
  const clouds = [part(0, even, { size: 0.6 * scene.spacing, most: 5, home: true }), part(even, after.length, { size: 0.04, most: 9 })]; // m, px: the second near targets

  function paint(colour) {
    const value = values[colour], table = tables[colour];
    for (let k = 0; k < value.length; k++) for (let c = 0; c < 3; c++) colours[3 * k + c] = table[3 * value[k] + c];
  }
  function facing(target) { // look at a target from the nearest place of the trajectory
    let best = Infinity, found = 0;
    for (let k = 0; k < track[1].length; k += 3) {
      const east = target.surveyed[0] - track[1][k], north = target.surveyed[1] - track[1][k + 1];
      if (Math.hypot(east, north) < best) [best, found] = [Math.hypot(east, north), Math.atan2(east, north)];
    }
    return found;
  }
  function over(pen, { project, mix, words, ratio }) {
    const mark = getComputedStyle(view.querySelector(".ring")).borderTopColor;
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
  }

  paint("intensity");
  const shown = turnable(view.querySelector(".stage"), clouds, over);
  for (const input of view.querySelectorAll("input")) input.addEventListener("change", () => {
    if (input.name === "colour") { paint(input.value); clouds.forEach(shown.recolour); }
    else shown.morph(Number(input.value));
  });
  const choice = view.querySelector("select"), named = new Map(scene.targets.map(target => [target.name, target]));
  for (const name of [...named.keys()].sort((a, b) => a.localeCompare(b, "en", { numeric: true }))) choice.append(new Option(name, name));
  const show = () => { const target = named.get(choice.value); if (target) shown.goTo(target.surveyed, facing(target)); else shown.goTo(null); };
  choice.addEventListener("change", show);
  document.addEventListener("click", event => { // rows of tables lead to their target or place
    const link = event.target.closest("a[data-target], a[data-place]");
    if (!link) return;
    if (link.dataset.place === undefined) { choice.value = link.dataset.target; show(); }
    else { choice.value = ""; shown.goTo(link.dataset.place.split(",").map((value, k) => value - scene.origin[k]), 0); }
  });
})();
