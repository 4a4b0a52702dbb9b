// A surface over two quantities, turned by dragging: quads from the farthest to the nearest, coloured as the map is.

// Cells along each side at most: more cannot be told apart and make the turning heavy.
const MOST_CELLS = 60;

function surface(place, height, { x, y, values, low, high, xLabel, yLabel, valueLabel, format, marked }) {
  const canvas = element("canvas", { class: "surface", title: "Drag to turn" });
  place.append(canvas);
  const every = (list) => {
    const step = Math.max(1, Math.ceil(list.length / MOST_CELLS));
    return list.map((_, i) => i).filter((i) => i % step === 0 || i === list.length - 1);
  };
  const [columns, rows] = [every(x), every(y)];
  const unit = (v, [a, b]) => (2 * (v - a)) / (b - a || 1) - 1;
  const [xs, ys] = [extent(x), extent(y)];
  const up = (v) => 0.7 * unit(v, [low, high]);
  let [turn, tilt] = [-0.6, 0.5];

  const paint = () => {
    const t = theme();
    const [width, ratio] = [place.clientWidth, window.devicePixelRatio || 1];
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
    const c = canvas.getContext("2d");
    c.scale(ratio, ratio);
    c.fillStyle = t.paper;
    c.fillRect(0, 0, width, height);
    const scale = Math.min(width, height * 1.25) * 0.28;
    // From the unit cube to pixels, and how far away.
    const seen = ([a, b, h]) => {
      const across = a * Math.cos(turn) - b * Math.sin(turn);
      const deep = a * Math.sin(turn) + b * Math.cos(turn);
      return [
        width / 2 + across * scale,
        height * 0.47 - (h * Math.cos(tilt) + deep * Math.sin(tilt)) * scale,
        deep * Math.cos(tilt) - h * Math.sin(tilt),
      ];
    };
    const text = (words, at, align = "center") => {
      c.font = "11px system-ui, sans-serif";
      c.textAlign = align;
      c.fillStyle = t.ink;
      // A halo, for words that lie on the surface.
      c.strokeStyle = t.paper;
      c.lineWidth = 3;
      c.strokeText(words, at[0], at[1]);
      c.fillText(words, at[0], at[1]);
    };
    const path = (points, stroke, fill) => {
      c.beginPath();
      points.forEach(([px, py], i) => (i ? c.lineTo(px, py) : c.moveTo(px, py)));
      if (fill) {
        c.closePath();
        c.fillStyle = fill;
        c.fill();
      }
      c.strokeStyle = stroke;
      c.lineWidth = fill ? 0.5 : 1;
      c.stroke();
    };
    const floor = (a, b) => seen([a, b, -0.7]);
    path([floor(-1, -1), floor(1, -1), floor(1, 1), floor(-1, 1), floor(-1, -1)], t.frame);
    const quads = [];
    for (let j = 0; j + 1 < rows.length; j++) {
      for (let i = 0; i + 1 < columns.length; i++) {
        const corners = [
          [i, j],
          [i + 1, j],
          [i + 1, j + 1],
          [i, j + 1],
        ];
        const heights = corners.map(([a, b]) => values[rows[b]][columns[a]]);
        if (heights.includes(null)) continue;
        const points = corners.map(([a, b], k) =>
          seen([unit(x[columns[a]], xs), unit(y[rows[b]], ys), up(heights[k])]),
        );
        const middle = heights.reduce((sum, h) => sum + h, 0) / 4;
        quads.push({
          points,
          deep: points.reduce((sum, p) => sum + p[2], 0),
          share: (middle - low) / (high - low || 1),
        });
      }
    }
    quads.sort((a, b) => b.deep - a.deep);
    for (const { points, share } of quads) {
      const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
      const from = Math.min(Math.floor(place), VIRIDIS.length - 2);
      const fill = echarts.color.lerp(place - from, [VIRIDIS[from], VIRIDIS[from + 1]]);
      path(points, "#00000040", fill);
    }
    for (const [a, b, name] of marked) {
      const h = values[nearest(y, b)][nearest(x, a)];
      if (h === null) continue;
      const foot = seen([unit(a, xs), unit(b, ys), up(h)]);
      const head = seen([unit(a, xs), unit(b, ys), up(h) + 0.35]);
      path([foot, head], seriesColour(1));
      text(name, [head[0], head[1] - 4]);
    }
    text(xLabel, floor(0, -1.22));
    text(yLabel, floor(-1.22, 0));
    for (const [a, v] of [
      [-1, xs[0]],
      [1, xs[1]],
    ])
      text(number(v, 3), floor(a, -1.1));
    for (const [b, v] of [
      [-1, ys[0]],
      [1, ys[1]],
    ])
      text(number(v, 3), floor(-1.1, b));
    text(`${valueLabel}: ${format(low)} to ${format(high)}`, [8, 16], "left");
  };

  let grip = null;
  canvas.addEventListener("pointerdown", (e) => {
    grip = { x: e.clientX, y: e.clientY, turn, tilt };
    canvas.setPointerCapture(e.pointerId);
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!grip) return;
    turn = grip.turn + (e.clientX - grip.x) * 0.01;
    tilt = Math.min(Math.max(grip.tilt + (e.clientY - grip.y) * 0.008, 0.05), 1.5);
    paint();
  });
  canvas.addEventListener("pointerup", () => {
    grip = null;
  });
  paint();
  drawn.push({ chart: { resize: paint }, draw: paint });
}
