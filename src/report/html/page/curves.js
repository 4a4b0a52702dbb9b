// Curves over a common quantity.

const MOST_IN_TIP = 8;

draw.curves = (place, data) => {
  const { curves } = data;
  // Curves of one label are one family: one entry in the legend.
  const labels = [...new Set(curves.map((c) => c.label).filter(Boolean))];
  const colour = (curve, i) =>
    curve.shade === null
      ? seriesColour(curve.label ? labels.indexOf(curve.label) : i)
      : scaleColour(curve.shade);
  const positive = (v) => (v !== null && v > 0 ? v : null);
  const points = (curve) =>
    curve.x.map((x, k) => [
      data.x_scale === "log" ? positive(x) : x,
      data.y_scale === "log" ? positive(curve.y[k]) : curve.y[k],
    ]);
  // Only curves over rising values have one height at each of them.
  const overX =
    curves.length <= MOST_IN_TIP && curves.every((c) => c.x.every((x, k) => k === 0 || x >= c.x[k - 1]));
  // A curve of gaps is dots.
  const isDots = (curve) => curve.y.every((y, k) => y === null || k === 0 || curve.y[k - 1] === null);
  const rows = (items) =>
    items
      .filter((p) => p.seriesIndex < curves.length)
      .map((p) => [p.color, curves[p.seriesIndex].label || data.y_label, number(p.value[1], 5)]);
  const area = (curve, fill) => {
    const [below, above] = curve.band;
    const drawable = (v) => v !== null && (data.y_scale !== "log" || v > 0);
    const seen = curve.x.map((x, k) => k).filter((k) => drawable(below[k]) && drawable(above[k]));
    return {
      name: curve.label,
      type: "custom",
      silent: true,
      z: 1,
      clip: true,
      // All of it goes into the axes' ranges; the first point draws it.
      data: seen.flatMap((k) => [below, above].map((side) => [curve.x[k], side[k]])),
      tooltip: { show: false },
      renderItem: (params, api) => {
        if (params.dataIndex > 0) return null;
        const along = (side, order) => order.map((k) => api.coord([curve.x[k], side[k]]));
        const points = [...along(below, seen), ...along(above, [...seen].reverse())];
        return { type: "polygon", shape: { points }, style: { fill, opacity: 0.16 } };
      },
    };
  };
  const option = () => ({
    grid: { left: 74, right: 20, top: 26, bottom: labels.length ? 74 : 46 },
    xAxis: axis(data.x_label, { type: data.x_scale === "log" ? "log" : "value" }),
    yAxis: axis(data.y_label, {
      type: data.y_scale === "log" ? "log" : "value",
      nameGap: 52,
      min: data.y_range?.[0],
      max: data.y_range?.[1],
    }),
    legend: legend(
      labels.map((name) => ({ name, icon: "roundRect", itemStyle: { opacity: 1 } })),
      { itemHeight: 4 },
    ),
    tooltip: tooltip(
      overX
        ? {
            trigger: "axis",
            formatter: (items) => tip(`${data.x_label}: ${number(items[0].value[0], 5)}`, rows(items)),
          }
        : { trigger: "item", formatter: (p) => tip(`${data.x_label}: ${number(p.value[0], 5)}`, rows([p])) },
    ),
    toolbox: toolbox({ filterMode: "none" }),
    dataZoom: ["xAxisIndex", "yAxisIndex"].map((which) => ({
      type: "inside",
      [which]: 0,
      zoomOnMouseWheel: "ctrl",
      moveOnMouseMove: false,
      moveOnMouseWheel: false,
      filterMode: "none",
    })),
    series: [
      ...curves.map((curve, i) => ({
        name: curve.label,
        type: "line",
        data: points(curve),
        showSymbol: isDots(curve),
        showAllSymbol: isDots(curve),
        symbol: "circle",
        symbolSize: overX ? 5 : 4,
        lineStyle: { color: colour(curve, i), width: 1.8 },
        itemStyle: { color: colour(curve, i) },
        triggerLineEvent: !overX,
        // Points that show under the mouse only are what the mouse finds.
        ...(overX
          ? {}
          : {
              showSymbol: true,
              showAllSymbol: true,
              symbolSize: 6,
              itemStyle: { color: colour(curve, i), opacity: isDots(curve) ? 1 : 0 },
              emphasis: { itemStyle: { opacity: 1 } },
            }),
      })),
      // Behind the curves, and after them: what the mouse finds counts them from the first.
      ...curves.flatMap((curve, i) => (curve.band ? [area(curve, colour(curve, i))] : [])),
    ],
  });
  const chart = mount(place, 360, option, dragToZoom);
  doubleClickResets(chart);
};
