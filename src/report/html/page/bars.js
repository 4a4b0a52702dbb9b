// Horizontal bars with intervals, strips of single values, and parameters within their bounds.

// A line with ends from `low` to `high` at the height of a row, and a mark in it if there is a median.
function whisker(api, low, high, row, colour, offset = 0, median = null) {
  const [x0, y] = api.coord([low, row]);
  const [x1] = api.coord([high, row]);
  const at = y + offset;
  const line = (xa, ya, xb, yb) => ({
    type: "line",
    shape: { x1: xa, y1: ya, x2: xb, y2: yb },
    style: { stroke: colour, lineWidth: 1.4 },
  });
  return {
    type: "group",
    children: [
      line(x0, at, x1, at),
      line(x0, at - 4, x0, at + 4),
      line(x1, at - 4, x1, at + 4),
      ...(median === null
        ? []
        : [{ type: "circle", shape: { cx: api.coord([median, row])[0], cy: at, r: 4 }, style: { fill: colour } }]),
    ],
  };
}

draw.bars = (place, data) => {
  const { series, categories } = data;
  const isStrip = (s) => s.singles.length > 0;
  const strips = series.every(isStrip);
  const value = (s, row) => {
    const interval = s.interval
      ? ` (${number(s.interval[0][row], 3)} to ${number(s.interval[1][row], 3)})`
      : "";
    return number(s.values[row], 4) + interval;
  };
  const option = () => {
    const t = theme();
    return {
      grid: { left: 10, right: 30, top: 26, bottom: series.length > 1 ? 74 : 50, containLabel: true },
      xAxis: axis(data.value_label, { scale: strips, type: data.scale === "log" ? "log" : "value" }),
      yAxis: {
        type: "category",
        data: categories,
        inverse: true,
        axisLabel: { color: t.ink, fontSize: 11 },
        axisTick: { show: false },
        axisLine: { lineStyle: { color: t.frame } },
      },
      legend: legend(series.length > 1 ? series.map((s) => s.name) : []),
      toolbox: { ...toolbox({}), feature: { saveAsImage: toolbox({}).feature.saveAsImage } },
      tooltip: tooltip(
        strips
          ? {
              trigger: "item",
              formatter: ({ value: [single, row], color }) =>
                tip(categories[row], [
                  [color, data.value_label, number(single, 5)],
                  ["transparent", "median (quartiles)", value(series[0], row)],
                ]),
            }
          : {
              trigger: "axis",
              axisPointer: { type: "shadow" },
              formatter: (items) =>
                tip(
                  categories[items[0].dataIndex],
                  series.map((s, i) => [
                    seriesColour(i),
                    s.name || data.value_label,
                    value(s, items[0].dataIndex),
                  ]),
                ),
            },
      ),
      series: series.flatMap((s, i) => [
        isStrip(s)
          ? {
              name: s.name,
              type: "scatter",
              data: s.singles.flatMap((values, row) => values.map((v) => [v, row])),
              symbolSize: 8,
              itemStyle: { color: seriesColour(i), opacity: 0.55 },
            }
          : {
              name: s.name,
              type: "bar",
              data: s.values,
              itemStyle: { color: seriesColour(i), opacity: 0.85 },
              barMaxWidth: 16,
            },
        ...(s.interval
          ? [
              {
                // Both ends go into the axis's range.
                name: s.name,
                type: "custom",
                silent: true,
                z: 5,
                data: categories.map((_, row) => [s.interval[0][row], s.interval[1][row], row]),
                encode: { x: [0, 1], y: 2 },
                renderItem: (params, api) => {
                  const row = params.dataIndex;
                  const [low, high] = [s.interval[0][row], s.interval[1][row]];
                  if (low === null || high === null) return null;
                  if (strips) return whisker(api, low, high, row, t.ink, 0, s.values[row]);
                  const layout = api.barLayout({ barMaxWidth: 16, count: series.length })[i];
                  return whisker(api, low, high, row, t.ink, layout.offsetCenter);
                },
              },
            ]
          : []),
      ]),
    };
  };
  mount(place, 100 + categories.length * Math.max(24, 16 * series.length + 8), option);
};

draw.parameters = (place, data) => {
  const { rows } = data;
  const share = (row, value) => (value === null ? null : (value - row.lower) / (row.upper - row.lower));
  const clamp = (v) => Math.min(Math.max(v, 0), 1);
  const places = (key) => rows.map((row, i) => [share(row, row[key]), i]);
  const describe = (i) => {
    const row = rows[i];
    const unit = row.unit ? ` ${row.unit}` : "";
    const lines = [
      ["transparent", "bounds", `${number(row.lower)} to ${number(row.upper)}${unit}`],
      [theme().faint, "swarm", number(row.swarm, 6) + unit],
      [seriesColour(0), row.told ? "fitted" : "fitted (the data do not tell it)", number(row.fitted, 6) + unit],
      ["transparent", "standard error", row.error === null ? "–" : number(row.error, 3) + unit],
    ];
    if (row.truth !== null) lines.push([seriesColour(1), "truth", number(row.truth, 6) + unit]);
    return tip(row.name, lines);
  };
  const option = () => {
    const t = theme();
    const marks = [
      {
        name: "swarm",
        data: places("swarm"),
        symbol: "circle",
        symbolSize: 10,
        itemStyle: { color: "transparent", borderColor: t.faint, borderWidth: 1.5 },
      },
      {
        name: "fitted",
        data: places("fitted").map((value, i) => ({
          value,
          itemStyle: rows[i].told ? {} : { color: t.frame },
        })),
        symbol: "circle",
        symbolSize: 7,
        itemStyle: { color: seriesColour(0) },
        z: 4,
      },
      {
        name: "truth",
        data: places("truth").filter((p) => p[0] !== null),
        symbol: "rect",
        symbolSize: [2, 16],
        itemStyle: { color: seriesColour(1) },
        z: 3,
      },
    ].filter((m) => m.data.length);
    return {
      grid: { left: 10, right: 30, top: 14, bottom: 74, containLabel: true },
      xAxis: axis("share of the way from the lower to the upper bound", { min: 0, max: 1 }),
      yAxis: {
        type: "category",
        inverse: true,
        data: rows.map((row) => withUnit(row.name, row.unit)),
        axisTick: { show: false },
        axisLine: { lineStyle: { color: t.frame } },
        axisLabel: { color: t.ink, fontSize: 11, interval: 0 },
        splitLine: { show: true, lineStyle: { color: t.grid } },
      },
      legend: legend(marks.map((m) => m.name)),
      tooltip: tooltip({
        trigger: "axis",
        axisPointer: { type: "shadow", axis: "y" },
        formatter: (items) => describe(items[0].value[1]),
      }),
      series: [
        {
          type: "custom",
          silent: true,
          data: rows.map((_, i) => [0, i]),
          z: 2,
          renderItem: (params, api) => {
            const row = rows[params.dataIndex];
            if (row.error === null || !row.told) return null;
            const [low, high] = [row.fitted - row.error, row.fitted + row.error].map((v) =>
              clamp(share(row, v)),
            );
            return whisker(api, low, high, params.dataIndex, seriesColour(0));
          },
        },
        ...marks.map((m) => ({ type: "scatter", ...m })),
      ],
    };
  };
  mount(place, 100 + rows.length * 24, option);
};
