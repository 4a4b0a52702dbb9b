// What all charts share: colours, numbers, elements, drawing again when the colours or the width change.

const darkColours = matchMedia("(prefers-color-scheme: dark)");
let printing = false;

function theme() {
  return darkColours.matches && !printing
    ? {
        ink: "#e6e6e6",
        faint: "#9aa3ad",
        grid: "#343a42",
        frame: "#59616b",
        paper: "#1b1f24",
        shade: "#ffffff0d",
        road: "#2b3138",
      }
    : {
        ink: "#222222",
        faint: "#66707a",
        grid: "#e6e8eb",
        frame: "#9aa0a6",
        paper: "#ffffff",
        shade: "#3b6ea512",
        road: "#eceef0",
      };
}

// Okabe and Ito's palette, readable with any colour vision; the last one follows the paper.
const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9"];
function seriesColour(n) {
  const i = n % (PALETTE.length + 1);
  return i < PALETTE.length ? PALETTE[i] : theme().ink;
}
// Lines beyond the last colour begin anew, dashed.
const isDashed = (n) => n > PALETTE.length;
function seriesStroke(n) {
  return { color: seriesColour(n), type: isDashed(n) ? "dashed" : "solid" };
}
function seriesSwatch(n) {
  const colour = seriesColour(n);
  return isDashed(n) ? `repeating-linear-gradient(90deg, ${colour} 0 5px, transparent 5px 8px)` : colour;
}

const VIRIDIS = [
  "#440154",
  "#472c7a",
  "#3b518b",
  "#2c718e",
  "#21908d",
  "#27ad81",
  "#5cc863",
  "#aadc32",
  "#fde725",
];
// The darkest and the brightest ends are hard to see on a page of their own shade.
function scaleColours() {
  return darkColours.matches && !printing ? VIRIDIS.slice(2) : VIRIDIS.slice(0, 8);
}
function scaleColour(share) {
  const colours = scaleColours();
  const place = Math.min(Math.max(share, 0), 1) * (colours.length - 1);
  const low = Math.min(Math.floor(place), colours.length - 2);
  return echarts.color.lerp(place - low, [colours[low], colours[low + 1]]);
}

const SUPERSCRIPT = {
  "-": "⁻",
  0: "⁰",
  1: "¹",
  2: "²",
  3: "³",
  4: "⁴",
  5: "⁵",
  6: "⁶",
  7: "⁷",
  8: "⁸",
  9: "⁹",
};
// A number to so many figures, with a true minus sign and powers of ten where plain digits would be long.
function number(value, figures = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-4 && size < 1e6) {
    const decimals = Math.max(0, figures - 1 - Math.floor(Math.log10(size)));
    return value.toFixed(decimals).replace("-", "−");
  }
  const [digits, exponent] = value.toExponential(figures - 1).split("e");
  const raised = [...String(Number(exponent))].map((c) => SUPERSCRIPT[c]).join("");
  return `${digits.replace("-", "−")}×10${raised}`;
}
// As above, without zeros that only fill up: for axes.
function tick(value) {
  const text = number(value, 5);
  return text.includes("×")
    ? text.replace(/\.?0+×/, "×").replace(/^1×/, "")
    : text.replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}
const withUnit = (label, unit) => (unit ? `${label} (${unit})` : label);

function extent(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const v of values) {
    if (v === null) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return [low, high];
}

// The index of the value nearest to `x` among rising values.
function nearest(values, x) {
  let [low, high] = [0, values.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] <= x) low = middle;
    else high = middle;
  }
  return Math.abs(values[high] - x) < Math.abs(values[low] - x) ? high : low;
}

// An element with text, never markup, in it.
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== false) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

// A tooltip's contents: a heading and rows of a colour, a name and a value.
function tip(heading, rows) {
  const table = element("table", { class: "tip" });
  for (const [colour, name, value] of rows) {
    const swatch = element("span", { class: "swatch" });
    swatch.style.background = colour;
    table.append(element("tr", {}, element("td", {}, swatch, name), element("td", { class: "number" }, value)));
  }
  return element("div", {}, element("strong", {}, heading), table);
}

function tooltip(extra) {
  const t = theme();
  return {
    confine: true,
    backgroundColor: t.paper,
    borderColor: t.frame,
    textStyle: { color: t.ink, fontSize: 12 },
    ...extra,
  };
}

function axis(name, extra = {}) {
  const t = theme();
  return {
    type: "value",
    name,
    nameLocation: "middle",
    nameGap: 28,
    nameTextStyle: { color: t.ink, fontSize: 12 },
    scale: true,
    axisLine: { show: true, lineStyle: { color: t.frame } },
    axisTick: { show: true, lineStyle: { color: t.frame } },
    axisLabel: { color: t.faint, fontSize: 11, formatter: tick, hideOverlap: true },
    splitLine: { lineStyle: { color: t.grid } },
    ...extra,
  };
}

function legend(data, extra = {}) {
  const t = theme();
  return {
    type: "scroll",
    bottom: 2,
    data,
    textStyle: { color: t.ink },
    inactiveColor: t.grid,
    pageTextStyle: { color: t.faint },
    pageIconColor: t.faint,
    itemWidth: 18,
    ...extra,
  };
}

// Buttons to drag a zoom, go back, and save a picture.
function toolbox(zoomed) {
  const t = theme();
  return {
    right: 8,
    top: 0,
    itemSize: 13,
    iconStyle: { borderColor: t.faint },
    emphasis: { iconStyle: { borderColor: t.ink } },
    feature: {
      dataZoom: { title: { zoom: "Drag to zoom", back: "Undo the zoom" }, ...zoomed },
      saveAsImage: { title: "Save as PNG", pixelRatio: 2, backgroundColor: t.paper },
    },
  };
}

const drawn = [];
// Draws a chart into `place`; `option` is asked again whenever colours change, `after` is called once drawn.
function mount(place, height, option, after = () => {}) {
  place.style.height = `${height}px`;
  const chart = echarts.init(place, null, { renderer: "canvas" });
  const draw = () => {
    chart.setOption(
      { animation: false, aria: { enabled: true }, textStyle: { fontFamily: "inherit" }, ...option() },
      { notMerge: true },
    );
    after(chart);
  };
  draw();
  drawn.push({ chart, draw });
  return chart;
}

// Dragging zooms without a button having been pressed first, and a double click goes back.
function dragToZoom(chart) {
  chart.dispatchAction({ type: "takeGlobalCursor", key: "dataZoomSelect", dataZoomSelectActive: true });
}
function doubleClickResets(chart) {
  chart.getZr().on("dblclick", () => {
    const zooms = chart.getOption().dataZoom ?? [];
    chart.dispatchAction({
      type: "dataZoom",
      batch: zooms.map((_, i) => ({ dataZoomIndex: i, start: 0, end: 100 })),
    });
  });
}

const draw = {};
