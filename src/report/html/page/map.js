// The track map: the road, the lines, one of them coloured by a quantity, a dot per line at the common cursor.

// Steps of colour: finer ones cannot be told apart.
const SHADES = 48;

function trackMap(place, lap, shown, onHover) {
  const { map, panels } = lap;
  const lines = lap.lines.map((line, i) => ({ ...line, index: i })).filter((line) => line.place);
  const xs = [...lines.map((line) => line.place[0]), map.left[0], map.right[0]].flat();
  const ys = [...lines.map((line) => line.place[1]), map.left[1], map.right[1]].flat();
  const whole = [extent(xs), extent(ys)];
  // The colours: which line, by which panel.
  let coloured = { line: lines[0].index, panel: lines[0].traces[0]?.panel };
  // What is seen: its middle (m) and its scale (m per pixel).
  let view;

  place.style.height = `${Math.min(520, Math.max(320, place.clientWidth * 0.85))}px`;
  const size = () => [place.clientWidth, place.clientHeight];
  const fitted = ([[x0, x1], [y0, y1]], room) => {
    const [width, height] = size();
    const scale = Math.max((x1 - x0) / (width - 2 * room), (y1 - y0) / (height - 2 * room), 1e-3);
    return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale };
  };
  const axes = () => {
    const [width, height] = size();
    const [across, up] = [(view.scale * width) / 2, (view.scale * height) / 2];
    return {
      xAxis: { min: view.x - across, max: view.x + across },
      yAxis: { min: view.y - up, max: view.y + up },
    };
  };
  let all = true;
  const look = (to, isAll = false) => {
    [view, all] = [to, isAll];
    chart.setOption(axes());
    dots();
  };
  const lookAtAll = () => look(fitted(whole, 26), true);
  const toPixel = (x, y) => {
    const [width, height] = size();
    return [width / 2 + (x - view.x) / view.scale, height / 2 - (y - view.y) / view.scale];
  };
  const toMetres = (px, py) => {
    const [width, height] = size();
    return [view.x + (px - width / 2) * view.scale, view.y - (py - height / 2) * view.scale];
  };

  const points = ([x, y], closed) => {
    const all = x.map((v, i) => [v, y[i]]);
    return closed && all.length ? [...all, all[0]] : all;
  };
  const plain = (id, data, colour, width) => ({
    id,
    type: "line",
    data,
    showSymbol: false,
    silent: true,
    lineStyle: { color: colour, width },
    emphasis: { disabled: true },
  });

  const values = () => {
    const line = lap.lines[coloured.line];
    return line.traces.find((trace) => trace.panel === coloured.panel)?.values ?? [];
  };
  // Runs of points of one shade, each drawn as one stroke.
  const runs = (line, of, [low, high]) => {
    const shade = (v) =>
      v === null || v === undefined ? -1 : Math.round((SHADES * (v - low)) / (high - low || 1));
    const found = [];
    for (let i = 0; i + 1 < line.x.length; i++) {
      const now = shade(of[i]);
      const last = found.at(-1);
      if (last && last.shade === now) last.to = i + 1;
      else found.push({ shade: now, from: i, to: i + 1 });
    }
    return found;
  };

  const option = () => {
    const t = theme();
    view ??= fitted(whole, 26);
    const line = lap.lines[coloured.line];
    const of = values();
    const range = extent(of);
    const strokes = shown(coloured.line) ? runs(line, of, range) : [];
    const bare = { show: false, type: "value" };
    const seen = axes();
    const name = panels[coloured.panel];
    const road =
      map.left[0].length && map.right[0].length
        ? [points(map.left, map.closed), points(map.right, map.closed)]
        : [];
    return {
      grid: { left: 0, right: 0, top: 0, bottom: 0 },
      xAxis: { ...bare, ...seen.xAxis },
      yAxis: { ...bare, ...seen.yAxis },
      series: [
        {
          id: "road",
          type: "custom",
          silent: true,
          data: road.length ? [0] : [],
          z: 0,
          renderItem: (_, api) => ({
            type: "polygon",
            shape: { points: [...road[0], ...road[1].slice().reverse()].map((p) => api.coord(p)) },
            style: { fill: t.road },
          }),
        },
        ...road.map((edge, i) => plain(`edge-${i}`, edge, t.frame, 1)),
        ...lines
          .filter((other) => other.index !== coloured.line && shown(other.index))
          .map((other) =>
            plain(`line-${other.index}`, points(other.place, false), seriesColour(other.index), 1.2),
          ),
        {
          id: "coloured",
          type: "custom",
          silent: true,
          data: strokes.map((_, i) => i),
          z: 5,
          renderItem: (params, api) => {
            const { shade, from, to } = strokes[params.dataIndex];
            const run = [];
            for (let i = from; i <= to; i++) run.push(api.coord([line.place[0][i], line.place[1][i]]));
            const stroke = shade < 0 ? t.faint : scaleColour(shade / SHADES);
            return {
              type: "polyline",
              shape: { points: run },
              style: { fill: null, stroke, lineWidth: 3, lineJoin: "round", lineCap: "round" },
            };
          },
        },
        {
          id: "names",
          type: "scatter",
          silent: true,
          symbolSize: 0.1,
          data: map.names.map(([label, x, y]) => ({ value: [x, y], name: label })),
          z: 8,
          label: {
            show: true,
            formatter: (p) => p.name,
            color: t.ink,
            fontSize: 11,
            textBorderColor: t.paper,
            textBorderWidth: 3,
            distance: 9,
            position: "top",
          },
          labelLayout: { hideOverlap: true },
        },
      ],
      visualMap: Number.isFinite(range[0])
        ? [
            {
              type: "continuous",
              seriesIndex: [],
              min: range[0],
              max: range[1],
              calculable: false,
              orient: "horizontal",
              left: 8,
              bottom: 6,
              itemWidth: 10,
              itemHeight: 110,
              inRange: { color: scaleColours() },
              precision: 1,
              padding: 0,
              textGap: 6,
              text: [`${number(range[1], 3)} ${name.unit}`, `${name.label} ${number(range[0], 3)}`],
              textStyle: { color: t.ink, fontSize: 11 },
            },
          ]
        : [],
    };
  };

  // Dots stand above the canvas, so that moving them draws nothing again.
  const marks = lines.map((line) => {
    const mark = element("span", { class: "dot", hidden: "" });
    mark.dataset.line = line.name;
    return mark;
  });
  let cursor = null;
  const dots = () => {
    lines.forEach((line, k) => {
      const mark = marks[k];
      const i = cursor === null ? 0 : nearest(line.x, cursor);
      const [px, py] = toPixel(line.place[0][i] ?? NaN, line.place[1][i] ?? NaN);
      const [width, height] = size();
      mark.hidden =
        cursor === null || !shown(line.index) || !(px >= 0 && py >= 0 && px <= width && py <= height);
      mark.style.transform = `translate(${px}px, ${py}px)`;
      mark.style.background = seriesSwatch(line.index);
    });
  };

  const chart = mount(place, place.clientHeight, option);
  place.append(...marks);

  const zr = chart.getZr();
  const zoom = (factor, px, py) => {
    const [x, y] = toMetres(px, py);
    look({ x: x + (view.x - x) * factor, y: y + (view.y - y) * factor, scale: view.scale * factor });
  };
  place.addEventListener(
    "wheel",
    (event) => {
      // Without the key the page scrolls, as one would expect of a page.
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      const box = place.getBoundingClientRect();
      zoom(event.deltaY > 0 ? 1.25 : 0.8, event.clientX - box.left, event.clientY - box.top);
    },
    { passive: false },
  );
  let grip = null;
  zr.on("mousedown", (e) => {
    grip = { px: e.offsetX, py: e.offsetY, x: view.x, y: view.y };
  });
  zr.on("mouseup", () => {
    grip = null;
  });
  zr.on("globalout", () => {
    grip = null;
  });
  zr.on("dblclick", () => lookAtAll());
  zr.on("mousemove", (e) => {
    if (grip) {
      look({
        x: grip.x - (e.offsetX - grip.px) * view.scale,
        y: grip.y + (e.offsetY - grip.py) * view.scale,
        scale: view.scale,
      });
      return;
    }
    const [x, y] = toMetres(e.offsetX, e.offsetY);
    let best = { distance: 18 * view.scale };
    for (const line of lines) {
      if (!shown(line.index)) continue;
      for (let i = 0; i < line.x.length; i++) {
        const distance = Math.hypot(line.place[0][i] - x, line.place[1][i] - y);
        if (distance < best.distance) best = { distance, at: line.x[i] };
      }
    }
    if (best.at !== undefined) onHover(best.at);
  });

  return {
    move(x) {
      cursor = x;
      dots();
    },
    redraw() {
      chart.setOption(option(), { replaceMerge: ["series", "visualMap"] });
      dots();
    },
    colour(line, panel) {
      coloured = { line, panel };
      this.redraw();
    },
    resized() {
      if (all) lookAtAll();
      else look(view);
    },
    zoom(factor) {
      const [w, h] = size();
      zoom(factor, w / 2, h / 2);
    },
    reset() {
      lookAtAll();
    },
    // Shows the stretch between two distances.
    follow(from, to) {
      const box = [
        [Infinity, -Infinity],
        [Infinity, -Infinity],
      ];
      for (const line of lines) {
        for (let i = nearest(line.x, from); i <= nearest(line.x, to); i++) {
          for (const k of [0, 1]) {
            const v = line.place[k][i];
            if (v === null) continue;
            box[k] = [Math.min(box[k][0], v), Math.max(box[k][1], v)];
          }
        }
      }
      if (box[0][0] <= box[0][1]) look(fitted(box, 40));
    },
    coloured: () => coloured,
    lines,
  };
}
