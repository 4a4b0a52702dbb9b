// Draws every chart, in the units that the reader chose, and makes the tables sort.

const data = JSON.parse(document.getElementById("charts").textContent);
inUnits(data);
for (const place of document.querySelectorAll("[data-chart]")) {
  const chart = data[Number(place.dataset.chart)];
  draw[chart.kind](place, chart);
}

const redrawAll = () => {
  for (const { chart, draw } of drawn) {
    chart.resize();
    draw();
    // At once: a printer does not wait for the next frame.
    chart.getZr?.().flush();
  }
};
let pending = 0;
addEventListener("resize", () => {
  clearTimeout(pending);
  pending = setTimeout(() => drawn.forEach(({ chart }) => chart.resize()), 120);
});
darkColours.addEventListener("change", redrawAll);
// On paper the light colours, at the width of the paper.
const folded = new Set();
addEventListener("beforeprint", () => {
  printing = true;
  for (const fold of document.querySelectorAll("details:not([open])")) {
    folded.add(fold);
    fold.open = true;
  }
  redrawAll();
});
addEventListener("afterprint", () => {
  printing = false;
  for (const fold of folded) fold.open = false;
  folded.clear();
  redrawAll();
});

function sortBy(table, column, descending) {
  const key = (row) => {
    const cell = row.cells[column];
    return cell.dataset.value === undefined ? cell.textContent : Number(cell.dataset.value);
  };
  const order = (a, b) => {
    const [x, y] = [key(a), key(b)];
    // Gaps stand last either way.
    if (x === "–" || y === "–") return (x === "–") - (y === "–");
    const sign = typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y));
    return descending ? -sign : sign;
  };
  const body = table.tBodies[0];
  body.append(...[...body.rows].sort(order));
}

for (const table of document.querySelectorAll(".table table")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const sort = () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      sortBy(table, column, descending);
    };
    head.tabIndex = 0;
    head.title = "Sort";
    head.addEventListener("click", sort);
    head.addEventListener("keydown", (event) => {
      if (event.key === "Enter") sort();
    });
  });
}
