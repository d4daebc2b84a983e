// tables that are sorted by a press on a heading, each group of rows by itself
for (const table of document.querySelectorAll("table.sortable")) {
  const headings = [...table.querySelectorAll("th[data-column]")];
  const text = (row, column) => row.cells[column].textContent.trim();
  for (const heading of headings) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const column = Number(heading.dataset.column);
      const sign = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      for (const body of table.tBodies) {
        const rows = [...body.rows].filter(row => !row.classList.contains("head"));
        const isText = rows.some(row => isNaN(parseFloat(text(row, column))) && text(row, column) !== "–");
        rows.sort((a, b) => {
          const [x, y] = [a, b].map(row => text(row, column));
          if (isText) return sign * x.localeCompare(y, "en", { numeric: true });
          const [u, v] = [x, y].map(parseFloat); // a dash is last
          return isNaN(u) - isNaN(v) || sign * (u - v) || 0;
        });
        body.append(...rows);
      }
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
    });
  }
}
addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details")) part.open = true; });
