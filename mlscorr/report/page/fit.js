// a table that is wider than the screen hides no column: its rows become blocks of names and values
for (const table of document.querySelectorAll(".scroll > table")) {
  if (!table.tHead) continue;
  const grid = [...table.tHead.rows].map(() => []);
  [...table.tHead.rows].forEach((row, k) => {
    let column = 0;
    for (const cell of row.cells) {
      while (grid[k][column] !== undefined) column++;
      const name = cell.textContent.trim();
      for (let i = 0; i < cell.rowSpan; i++) for (let j = 0; j < cell.colSpan; j++) grid[k + i][column + j] = i ? "" : name;
    }
  });
  for (const body of table.tBodies) for (const row of body.rows) for (const cell of row.cells) {
    if (cell.tagName === "TD") cell.dataset.name = grid.map(names => names[cell.cellIndex]).filter(Boolean).join(" ");
  }
  const box = table.parentElement;
  const fit = () => {
    table.classList.remove("stacked");
    table.classList.toggle("stacked", box.scrollWidth > box.clientWidth + 1);
  };
  fit();
  addEventListener("resize", fit);
  box.closest("details")?.addEventListener("toggle", fit);
  addEventListener("beforeprint", () => table.classList.remove("stacked"));
  addEventListener("afterprint", fit);
}
