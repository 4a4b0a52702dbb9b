// Traces over a lap and the map beside them, moved by one cursor.

const PANEL_PX = 118;
const BETWEEN_PX = 12;
// Room above the panels for the buttons.
const HEAD_PX = 30;
const LEFT_PX = 76;

draw.lap = (place, lap) => {
  const hidden = new Set();
  const shown = (i) => !hidden.has(i);
  const { panels, lines } = lap;

  // What goes with a panel of full height stands in its column of the read-out.
  const columns = [];
  const columnOf = panels.map((panel) => {
    if (panel.height >= 1 || !columns.length) columns.push(panel);
    return columns.length - 1;
  });

  const traces = element("div", { class: "traces" });
  const side = element("div", { class: "side" });
  const canvas = element("div", { class: "map" });
  const where = element("caption", {}, "Move along the traces or the map.");
  const readout = element("table", { class: "readout" }, where);
  const head = element("tr", {}, element("th", {}));
  for (const column of columns)
    head.append(
      element("th", { class: "number" }, column.label, element("span", { class: "unit" }, ` ${column.unit}`)),
    );
  readout.append(element("thead", {}, head));
  const body = element("tbody");
  readout.append(body);
  const cells = lines.map((line, i) => {
    const box = element("input", { type: "checkbox", checked: "" });
    const swatch = element("span", { class: "swatch" });
    swatch.style.background = seriesSwatch(i);
    const row = element(
      "tr",
      {},
      element("th", { scope: "row" }, element("label", {}, box, swatch, line.name)),
    );
    const mine = columns.map(() => element("td", { class: "number" }, "–"));
    row.append(...mine);
    body.append(row);
    box.addEventListener("change", () => {
      if (box.checked) hidden.delete(i);
      else hidden.add(i);
      chart.dispatchAction({ type: box.checked ? "legendSelect" : "legendUnSelect", name: seriesName(i) });
      map?.redraw();
    });
    return mine;
  });
  place.append(traces, side);
  place.classList.add("lap");
  // Names may come twice; series go by their number.
  const seriesName = (i) => `${i}`;

  const tops = [];
  let bottom = HEAD_PX;
  for (const panel of panels) {
    tops.push(bottom);
    bottom += PANEL_PX * panel.height + BETWEEN_PX;
  }
  const height = bottom + 78;

  const option = () => {
    const t = theme();
    const last = panels.length - 1;
    const series = lines.flatMap((line, i) =>
      line.traces.flatMap((trace) => {
        const common = { name: seriesName(i), xAxisIndex: trace.panel, yAxisIndex: trace.panel, silent: true };
        const curve = {
          ...common,
          type: "line",
          data: line.x.map((x, k) => [x, trace.values[k]]),
          showSymbol: false,
          sampling: "lttb",
          emphasis: { disabled: true },
          lineStyle: line.wide
            ? { ...seriesStroke(i), width: 4, opacity: 0.45 }
            : { ...seriesStroke(i), width: 1.4 },
          itemStyle: { color: seriesColour(i) },
          z: 10 + i,
        };
        return trace.band ? [bandSeries(common, line.x, trace.band, seriesColour(i)), curve] : [curve];
      }),
    );
    const areas = panels.map((_, k) => ({
      type: "line",
      data: [],
      xAxisIndex: k,
      yAxisIndex: k,
      silent: true,
      markArea: {
        silent: true,
        itemStyle: { color: t.shade },
        label: { show: k === 0, position: "insideTop", color: t.faint, fontSize: 10 },
        data: lap.sections.map((s) => [{ name: s.name, xAxis: s.start }, { xAxis: s.end }]),
      },
    }));
    return {
      grid: panels.map((panel, k) => ({
        left: LEFT_PX,
        right: 14,
        top: tops[k],
        height: PANEL_PX * panel.height,
        outerBoundsMode: "none",
      })),
      xAxis: panels.map((_, k) =>
        axis(k === last ? withUnit(lap.x_label, lap.x_unit) : "", {
          gridIndex: k,
          min: startOf,
          max: "dataMax",
          axisLabel: {
            show: k === last,
            color: t.faint,
            fontSize: 11,
            formatter: tick,
            hideOverlap: true,
            showMaxLabel: false,
          },
          axisTick: { show: k === last },
        }),
      ),
      yAxis: panels.map((panel, k) =>
        axis(panel.unit && panel.height >= 1 ? `${panel.label}\n${panel.unit}` : panel.label, {
          gridIndex: k,
          nameGap: 52,
          nameMoveOverlap: false,
          splitNumber: panel.height < 1 ? 2 : 4,
          nameTextStyle: { color: t.ink, fontSize: 11, lineHeight: 13 },
          axisLabel: { color: t.faint, fontSize: 10, formatter: tick, hideOverlap: true },
        }),
      ),
      series: [...areas, ...series],
      legend: {
        show: false,
        data: lines.map((_, i) => seriesName(i)),
        selected: Object.fromEntries(lines.map((_, i) => [seriesName(i), shown(i)])),
      },
      tooltip: { trigger: "axis", showContent: false },
      axisPointer: {
        link: [{ xAxisIndex: "all" }],
        lineStyle: { color: t.ink, width: 1, type: "solid" },
        label: { show: false },
        triggerTooltip: true,
        snap: false,
      },
      toolbox: toolbox({ xAxisIndex: "all", yAxisIndex: false }),
      dataZoom: [
        {
          type: "slider",
          xAxisIndex: "all",
          bottom: 8,
          height: 20,
          left: LEFT_PX,
          right: 14,
          borderColor: t.frame,
          fillerColor: t.shade,
          textStyle: { color: t.faint },
          labelFormatter: (v) => tick(Math.round(v)),
          showDataShadow: false,
          brushSelect: false,
          filterMode: "none",
        },
        {
          type: "inside",
          xAxisIndex: "all",
          zoomOnMouseWheel: "ctrl",
          moveOnMouseMove: false,
          moveOnMouseWheel: false,
          filterMode: "none",
        },
      ],
    };
  };
  const chart = mount(traces, height, option, dragToZoom);
  doubleClickResets(chart);

  let map = null;
  const show = (x) => {
    const section = lap.sections.find((s) =>
      s.start <= s.end ? s.start <= x && x <= s.end : x >= s.start || x <= s.end,
    );
    where.textContent = `${lap.x_label} ${number(x, 5)} ${lap.x_unit}${section ? ` – ${section.name}` : ""}`;
    lines.forEach((line, i) => {
      const k = nearest(line.x, x);
      for (const trace of line.traces) cells[i][columnOf[trace.panel]].textContent = number(trace.values[k], 4);
    });
    map?.move(x);
  };
  chart.on("updateAxisPointer", (event) => {
    const at = event.axesInfo?.find((info) => info.axisDim === "x");
    if (at) show(at.value);
  });
  const stretch = () => chart.getModel().getComponent("xAxis", 0).axis.scale.getExtent();
  chart.on("datazoom", () => map?.follow(...stretch()));

  if (lap.map && lines.some((line) => line.place)) {
    const fromMap = (x) => {
      const [px] = chart.convertToPixel({ gridIndex: 0 }, [x, 0]);
      chart.dispatchAction({ type: "showTip", x: px, y: tops[0] + PANEL_PX / 2 });
      show(x);
    };
    const which = element("select", { "aria-label": "line to colour" });
    const by = element("select", { "aria-label": "quantity to colour by" });
    const button = (text, title, act) => {
      const made = element("button", { type: "button", title }, text);
      made.addEventListener("click", act);
      return made;
    };
    side.append(
      element(
        "div",
        { class: "controls" },
        "Colour ",
        which,
        " by ",
        by,
        element("span", { class: "spring" }),
        button("+", "Zoom in", () => map.zoom(0.7)),
        button("−", "Zoom out", () => map.zoom(1.4)),
        button("all", "The whole track", () => map.reset()),
      ),
      canvas,
    );
    map = trackMap(canvas, lap, shown, fromMap);
    for (const line of map.lines) which.append(element("option", { value: line.index }, line.name));
    const offer = () => {
      const before = by.value;
      by.replaceChildren();
      for (const trace of lines[which.value].traces)
        by.append(element("option", { value: trace.panel }, panels[trace.panel].label));
      if ([...by.options].some((o) => o.value === before)) by.value = before;
    };
    offer();
    which.addEventListener("change", () => {
      offer();
      map.colour(Number(which.value), Number(by.value));
    });
    by.addEventListener("change", () => map.colour(Number(which.value), Number(by.value)));
    drawn.push({
      chart: {
        resize() {
          map.resized();
        },
      },
      draw() {},
    });
  } else {
    place.classList.add("mapless");
  }
  side.append(readout);
  side.append(
    element(
      "p",
      { class: "note" },
      map
        ? "Drag across the traces to zoom; the map follows, and a double click goes back. Drag the map to move it, turn the wheel with Ctrl held to zoom it."
        : "Drag across the traces to zoom; a double click goes back.",
    ),
  );
};

// Where an axis starts: at zero if the first value is all but there.
const startOf = ({ min, max }) => (Math.abs(min) < 0.01 * (max - min) ? Math.min(min, 0) : min);

// The room between two curves over `x`.
function bandSeries(common, x, [low, high], colour) {
  return {
    ...common,
    type: "custom",
    data: [0],
    encode: { x: -1, y: -1 },
    z: 5,
    clip: true,
    renderItem: (_, api) => {
      const finite = x.map((_, i) => i).filter((i) => low[i] !== null && high[i] !== null);
      const up = finite.map((i) => api.coord([x[i], high[i]]));
      const down = finite.map((i) => api.coord([x[i], low[i]])).reverse();
      return { type: "polygon", shape: { points: [...up, ...down] }, style: { fill: colour, opacity: 0.18 } };
    },
  };
}
