// Candidates by their objectives: a scatter over any two, coloured by a third, and parallel coordinates.

draw.front = (place, data) => {
  const names = data.objectives.map(([name, unit]) => withUnit(name, unit));
  const count = data.points[0].length;
  const row = (i) => data.points.map((column) => column[i]);
  const markOf = new Map(data.marked);
  let [across, up, shade] = [0, 1, Math.min(2, names.length - 1)];
  // Candidates inside the ranges that the reader has drawn on the parallel axes; all without any.
  let chosen = null;

  const scatter = element("div");
  const choice = (label, value, set) => {
    const select = element("select");
    names.forEach((name, k) => select.append(element("option", { value: k }, name)));
    select.value = value;
    select.addEventListener("change", () => {
      set(Number(select.value));
      redraw();
    });
    return element("label", {}, `${label} `, select);
  };
  place.append(
    element(
      "div",
      { class: "controls" },
      choice("across", across, (k) => {
        across = k;
      }),
      choice("up", up, (k) => {
        up = k;
      }),
      choice("colour", shade, (k) => {
        shade = k;
      }),
    ),
    scatter,
  );

  const describe = (i) =>
    tip(
      markOf.get(i) ?? `candidate ${i}`,
      names.map((name, k) => ["transparent", name, number(data.points[k][i], 6)]),
    );
  const option = () => {
    const t = theme();
    const [low, high] = extent(data.points[shade]);
    const points = Array.from({ length: count }, (_, i) => ({
      value: [data.points[across][i], data.points[up][i], data.points[shade][i], i],
      itemStyle: { opacity: chosen && !chosen.has(i) ? 0.12 : 1 },
    }));
    return {
      grid: { left: 74, right: 110, top: 26, bottom: 46 },
      xAxis: axis(names[across]),
      yAxis: axis(names[up], { nameGap: 54 }),
      tooltip: tooltip({ trigger: "item", formatter: (p) => describe(p.value[3]) }),
      toolbox: toolbox({ filterMode: "none" }),
      dataZoom: ["xAxisIndex", "yAxisIndex"].map((which) => ({
        type: "inside",
        [which]: 0,
        zoomOnMouseWheel: "ctrl",
        moveOnMouseMove: false,
        moveOnMouseWheel: false,
        filterMode: "none",
      })),
      visualMap: {
        type: "continuous",
        dimension: 2,
        seriesIndex: 0,
        min: low,
        max: high,
        right: 4,
        top: "middle",
        itemHeight: 150,
        itemWidth: 12,
        calculable: false,
        inRange: { color: scaleColours() },
        text: [number(high, 4), number(low, 4)],
        textStyle: { color: t.ink, fontSize: 11 },
      },
      series: [
        { type: "scatter", data: points, symbolSize: 9 },
        {
          type: "scatter",
          symbol: "circle",
          symbolSize: 17,
          z: 3,
          itemStyle: { color: "transparent", borderColor: t.ink, borderWidth: 1.6 },
          data: data.marked.map(([i, name]) => ({
            value: [data.points[across][i], data.points[up][i], 0, i],
            name,
          })),
          label: {
            show: true,
            position: "top",
            formatter: (p) => p.name,
            color: t.ink,
            fontSize: 11,
            textBorderColor: t.paper,
            textBorderWidth: 2,
          },
        },
      ],
    };
  };
  const chart = mount(scatter, 400, option, dragToZoom);
  doubleClickResets(chart);
  const redraw = () => {
    chart.setOption(option(), { replaceMerge: ["series"] });
  };
  if (names.length < 3) return;

  const parallel = element("div");
  place.append(
    element(
      "p",
      { class: "note" },
      "One curve a candidate, coloured by the last objective. Drag along an axis to pick a range of it; click the axis to let it go.",
    ),
    parallel,
  );
  const parallelOption = () => {
    const t = theme();
    const last = names.length - 1;
    const [low, high] = extent(data.points[last]);
    return {
      parallel: {
        left: 70,
        right: 90,
        top: 44,
        bottom: 24,
        parallelAxisDefault: { nameTextStyle: { color: t.ink, fontSize: 12 }, nameGap: 16 },
      },
      parallelAxis: names.map((name, dim) => ({
        dim,
        name,
        scale: true,
        type: "value",
        axisLine: { lineStyle: { color: t.frame } },
        axisTick: { lineStyle: { color: t.frame } },
        splitLine: { show: false },
        axisLabel: { color: t.faint, fontSize: 11, formatter: tick },
        min: "dataMin",
        max: "dataMax",
      })),
      tooltip: tooltip({}),
      visualMap: { show: false, dimension: last, min: low, max: high, inRange: { color: scaleColours() } },
      series: [
        {
          type: "parallel",
          data: Array.from({ length: count }, (_, i) => ({
            value: row(i),
            lineStyle: markOf.has(i) ? { width: 4, opacity: 1 } : {},
          })),
          lineStyle: { width: 1.4, opacity: 0.7 },
          inactiveOpacity: 0.06,
          tooltip: { formatter: (p) => describe(p.dataIndex) },
        },
      ],
    };
  };
  const second = mount(parallel, 330, parallelOption);
  second.on("axisareaselected", () => {
    const picked = second.getModel().getSeries()[0].getRawIndicesByActiveState("active");
    const all = second.getModel().getComponent("parallel", 0) && picked.length === 0;
    chosen = all ? null : new Set(picked);
    redraw();
  });
};
