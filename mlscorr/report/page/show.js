// clouds and lines in 3D, each with a check box
(() => {
  const view = document.querySelector(".turn");
  view.hidden = false;
  const scene = JSON.parse(document.getElementById("scene").textContent), stage = view.querySelector(".stage");
  const boxes = [...view.querySelectorAll("input")];
  const layers = scene.layers.map(layer => {
    const places = floats(layer.places), colours = bytes(layer.colours);
    if (layer.pairs === undefined) return { before: places, after: places, colours, size: 0.6 * layer.spacing, most: 6, home: true };
    return { places, colours, pairs: new Uint32Array(bytes(layer.pairs).buffer) };
  });
  const clouds = layers.filter(layer => layer.after), sets = layers.filter(layer => layer.places);
  const runs = sets.map(({ pairs, colours }) => { // of one color each, so that a run is one stroke
    const found = [];
    const same = (a, b) => [0, 1, 2].every(c => colours[3 * a + c] === colours[3 * b + c]);
    for (let k = 0, first = 0; k < pairs.length / 2; k++) if (k + 1 === pairs.length / 2 || !same(first, k + 1)) { found.push([first, k + 1]); first = k + 1; }
    return found;
  });

  function over(pen, { project, ratio }) {
    pen.lineCap = pen.lineJoin = "round"; pen.lineWidth = 2.5 * ratio;
    sets.forEach(({ places, colours, pairs, shown }, number) => {
      if (shown === false) return;
      const at = k => project([places[3 * k], places[3 * k + 1], places[3 * k + 2]]);
      for (const [first, end] of runs[number]) {
        pen.strokeStyle = `rgb(${colours.subarray(3 * first, 3 * first + 3).join()})`; pen.beginPath();
        let last = -1;
        for (let k = first; k < end; k++) {
          const [a, b] = [pairs[2 * k], pairs[2 * k + 1]], to = at(b), from = a === last ? null : at(a);
          if (to && a === last) pen.lineTo(to[0], to[1]);
          else if (to && from) { pen.moveTo(from[0], from[1]); pen.lineTo(to[0] + 0.01, to[1]); } // else a line of no length is not drawn
          last = to && (from || a === last) ? b : -1;
        }
        pen.stroke();
      }
    });
  }

  const shown = turnable(stage, clouds, over, sets.map(set => set.places));
  const toggle = () => { boxes.forEach((box, k) => { layers[k].shown = box.checked; }); shown.redraw(); };
  for (const box of boxes) box.addEventListener("change", toggle);
  stage.addEventListener("keydown", e => { // 1 to 9 show and hide
    const box = boxes[Number(e.key) - 1];
    if (box && !e.ctrlKey) { box.checked = !box.checked; toggle(); }
  });
  toggle();
})();
