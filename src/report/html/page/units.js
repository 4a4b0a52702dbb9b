// Engineers' units in place of SI. Files keep SI; the reader's choice is remembered.

const ENGINEERS = {
  "m/s": ["km/h", 3.6],
  "m/s²": ["g", 1 / 9.80665],
  rad: ["deg", 180 / Math.PI],
  "rad/s": ["deg/s", 180 / Math.PI],
  Pa: ["bar", 1e-5],
};
const UNITS_KEY = "lapswarm units";
// A browser may forbid a page from disk to keep anything: then there is no switch.
function remembered() {
  try {
    return localStorage.getItem(UNITS_KEY) ?? "engineers";
  } catch {
    return null;
  }
}

const scaled = (values, factor) => values.map((v) => (v === null ? null : v * factor));

// A label such as "speed (m/s)" in engineers' units, and the factor that goes with it.
function relabelled(label) {
  const found = /^(.*)\(([^()]*)\)$/.exec(label ?? "");
  const unit = found && ENGINEERS[found[2]];
  return unit ? [`${found[1]}(${unit[0]})`, unit[1]] : [label, 1];
}

function lapInEngineers(lap) {
  const factors = lap.panels.map((panel) => {
    const [name, factor] = ENGINEERS[panel.unit] ?? [panel.unit, 1];
    panel.unit = name;
    return factor;
  });
  for (const trace of lap.lines.flatMap((line) => line.traces)) {
    const factor = factors[trace.panel];
    if (factor === 1) continue;
    trace.values = scaled(trace.values, factor);
    if (trace.band) trace.band = trace.band.map((end) => scaled(end, factor));
  }
}

function curvesInEngineers(data) {
  for (const axis of ["x", "y"]) {
    const [label, factor] = relabelled(data[`${axis}_label`]);
    data[`${axis}_label`] = label;
    if (factor === 1) continue;
    for (const curve of data.curves) {
      curve[axis] = scaled(curve[axis], factor);
      if (axis === "y" && curve.band) curve.band = curve.band.map((side) => scaled(side, factor));
    }
    if (axis === "y" && data.y_range) data.y_range = scaled(data.y_range, factor);
  }
}

function barsInEngineers(data) {
  const [label, factor] = relabelled(data.value_label);
  data.value_label = label;
  if (factor === 1) return;
  for (const bars of data.series) {
    bars.values = scaled(bars.values, factor);
    bars.interval = bars.interval && bars.interval.map((side) => scaled(side, factor));
    bars.singles = bars.singles.map((values) => scaled(values, factor));
  }
}

function surfaceInEngineers(data) {
  ["x", "y"].forEach((axis, place) => {
    const [label, factor] = relabelled(data[`${axis}_label`]);
    data[`${axis}_label`] = label;
    data[axis] = scaled(data[axis], factor);
    for (const mark of data.marked) mark[place] *= factor;
  });
  const [label, factor] = relabelled(data.value_label);
  data.value_label = label;
  data.values = data.values.map((row) => scaled(row, factor));
}

function tableInEngineers(table) {
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const place = head.querySelector(".unit");
    const unit = place && ENGINEERS[place.textContent];
    if (!unit) return;
    place.textContent = unit[0];
    for (const row of table.tBodies[0].rows) {
      const cell = row.cells[column];
      if (cell.dataset.value === undefined) continue;
      const value = Number(cell.dataset.value) * unit[1];
      cell.dataset.value = value;
      cell.textContent = tick(Number(value.toPrecision(4)));
    }
  });
}

function tileInEngineers(tile) {
  const place = tile.querySelector(".unit");
  const unit = place && ENGINEERS[place.textContent];
  const value = Number(tile.firstChild?.textContent.replace("−", "-"));
  if (!unit || !Number.isFinite(value)) return;
  place.textContent = unit[0];
  tile.firstChild.textContent = `${number(value * unit[1], 3)} `;
}

function inUnits(charts) {
  const choice = remembered();
  if (choice === null) return;
  const engineers = choice !== "si";
  const button = element(
    "button",
    { type: "button", class: "units", "aria-pressed": `${engineers}`, title: "Text, pictures and files stay in SI." },
    engineers ? "km/h, g, degrees, bar: change to SI" : "SI: change to km/h, g, degrees, bar",
  );
  button.addEventListener("click", () => {
    localStorage.setItem(UNITS_KEY, engineers ? "si" : "engineers");
    location.reload();
  });
  document.querySelector("header").append(button);
  if (!engineers) return;
  for (const chart of charts) {
    if (chart.kind === "lap") lapInEngineers(chart);
    if (chart.kind === "curves") curvesInEngineers(chart);
    if (chart.kind === "bars") barsInEngineers(chart);
    if (chart.kind === "surface") surfaceInEngineers(chart);
  }
  document.querySelectorAll(".table table").forEach(tableInEngineers);
  document.querySelectorAll(".tiles dd").forEach(tileInEngineers);
}
