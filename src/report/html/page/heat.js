// Values over two quantities: cells of colour, lines of constant value, marks.

const LEVELS = 10;
const HEAT_PX = 440;

// Ends of the cells about rising values.
function cellEnds(values) {
  const middles = values.slice(1).map((v, i) => (v + values[i]) / 2);
  return [values[0], ...middles, values.at(-1)];
}

// Pieces of the line where the values over a grid are `level`, by marching squares.
function contour(x, y, values, level) {
  const pieces = [];
  for (let j = 0; j + 1 < y.length; j++) {
    for (let i = 0; i + 1 < x.length; i++) {
      const corners = [
        [i, j],
        [i + 1, j],
        [i + 1, j + 1],
        [i, j + 1],
      ];
      const heights = corners.map(([a, b]) => values[b][a]);
      if (heights.includes(null)) continue;
      const crossings = [];
      for (let k = 0; k < 4; k++) {
        const [h0, h1] = [heights[k], heights[(k + 1) % 4]];
        if (h0 < level === h1 < level) continue;
        const part = (level - h0) / (h1 - h0);
        const [[a0, b0], [a1, b1]] = [corners[k], corners[(k + 1) % 4]];
        crossings.push([x[a0] + part * (x[a1] - x[a0]), y[b0] + part * (y[b1] - y[b0])]);
      }
      for (let k = 0; k + 1 < crossings.length; k += 2) pieces.push([crossings[k], crossings[k + 1]]);
    }
  }
  return pieces;
}

draw.surface = (place, data) => {
  const { x, y } = data;
  const [least] = extent(data.values.flat());
  // The root of the value above its least: it spreads a basin's bottom.
  const values = data.values.map((row) => row.map((v) => (v === null ? null : Math.sqrt(v - least))));
  const shownValue = (v) => number(least + v * v, 3);
  const [low, high] = extent(values.flat());
  const [xEnds, yEnds] = [cellEnds(x), cellEnds(y)];
  const cells = values
    .flatMap((row, j) => row.map((v, i) => [x[i], y[j], v, i, j]))
    .filter((cell) => cell[2] !== null);
  const levels = Array.from({ length: LEVELS }, (_, k) => low + ((k + 0.5) / LEVELS) * (high - low));
  const lines = levels.flatMap((level) => contour(x, y, values, level));
  const option = () => {
    const t = theme();
    return {
      grid: { left: 84, right: 110, top: 26, bottom: 50 },
      xAxis: axis(data.x_label, { min: x[0], max: x.at(-1), splitLine: { show: false } }),
      yAxis: axis(data.y_label, { min: y[0], max: y.at(-1), splitLine: { show: false }, nameGap: 58 }),
      tooltip: tooltip({
        trigger: "item",
        formatter: (p) =>
          p.seriesIndex === 0
            ? tip(data.value_label, [
                ["transparent", data.x_label, number(p.value[0])],
                ["transparent", data.y_label, number(p.value[1])],
                [p.color, data.value_label, shownValue(p.value[2])],
              ])
            : tip(p.name, [
                ["transparent", data.x_label, number(p.value[0])],
                ["transparent", data.y_label, number(p.value[1])],
              ]),
      }),
      toolbox: { ...toolbox({}), feature: { saveAsImage: toolbox({}).feature.saveAsImage } },
      visualMap: {
        type: "continuous",
        dimension: 2,
        seriesIndex: 0,
        min: low,
        max: high,
        calculable: true,
        right: 4,
        top: "middle",
        itemHeight: 200,
        itemWidth: 14,
        inRange: { color: VIRIDIS },
        formatter: shownValue,
        textStyle: { color: t.ink, fontSize: 11 },
      },
      series: [
        {
          type: "custom",
          data: cells,
          clip: true,
          renderItem: (_, api) => {
            const [i, j] = [api.value(3), api.value(4)];
            const [x0, y0] = api.coord([xEnds[i], yEnds[j]]);
            const [x1, y1] = api.coord([xEnds[i + 1], yEnds[j + 1]]);
            // Half a pixel over: no seams.
            return {
              type: "rect",
              shape: { x: x0, y: y1, width: x1 - x0 + 0.5, height: y0 - y1 + 0.5 },
              style: { fill: api.visual("color") },
            };
          },
        },
        {
          type: "custom",
          silent: true,
          data: [0],
          clip: true,
          z: 3,
          encode: { x: -1, y: -1 },
          renderItem: (_, api) => ({
            type: "group",
            children: lines.map(([from, to]) => {
              const [[x1, y1], [x2, y2]] = [api.coord(from), api.coord(to)];
              return {
                type: "line",
                shape: { x1, y1, x2, y2 },
                style: { stroke: "#ffffff99", lineWidth: 0.8 },
              };
            }),
          }),
        },
        {
          type: "scatter",
          z: 5,
          symbol: "pin",
          symbolSize: 26,
          itemStyle: { color: seriesColour(1), borderColor: "#ffffff", borderWidth: 1 },
          data: data.marked.map(([a, b, name]) => ({ value: [a, b], name })),
          label: {
            show: true,
            position: "top",
            formatter: (p) => p.name,
            color: t.ink,
            textBorderColor: t.paper,
            textBorderWidth: 3,
            fontSize: 12,
          },
        },
      ],
    };
  };
  const [flat, solid] = [element("div"), element("div")];
  place.classList.add("pair");
  place.append(flat, solid);
  mount(flat, HEAT_PX, option);
  surface(solid, HEAT_PX, {
    x,
    y,
    values,
    low,
    high,
    xLabel: data.x_label,
    yLabel: data.y_label,
    valueLabel: data.value_label,
    format: shownValue,
    marked: data.marked,
  });
};
