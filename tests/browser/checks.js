// Stands last in the page under test: uses it as a reader would, and writes down what came of it.
(async () => {
  const pause = (ms) => new Promise((done) => setTimeout(done, ms));
  const findings = { faults };

  // A canvas with nothing on it is all of one colour.
  const painted = (canvas) => {
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    const colours = new Set();
    for (let i = 0; i < pixels.length && colours.size < 4; i += 4)
      colours.add(`${pixels[i]},${pixels[i + 1]},${pixels[i + 2]},${pixels[i + 3]}`);
    return colours.size >= 4;
  };
  const move = (box, x, y, kinds = ["mousemove"]) => {
    const canvas = box.querySelector("canvas");
    const corner = box.getBoundingClientRect();
    for (const kind of kinds) {
      const about = {
        bubbles: true,
        cancelable: true,
        clientX: corner.left + x,
        clientY: corner.top + y,
        view: window,
      };
      canvas.dispatchEvent(new PointerEvent(kind.replace("mouse", "pointer"), about));
      canvas.dispatchEvent(new MouseEvent(kind, about));
    }
  };

  try {
    await pause(300);
    const charts = [...document.querySelectorAll("[data-chart]")];
    findings.charts = charts.length;
    findings.blank = charts.filter((chart) => ![...chart.querySelectorAll("canvas")].some(painted)).length;
    const measured = [...document.querySelectorAll(".table th")].find((th) => th.textContent === "n g");
    const column = measured && [...measured.parentElement.cells].indexOf(measured);
    findings.in_g =
      measured && [...measured.closest("table").tBodies[0].rows].map((row) => row.cells[column].textContent);
    findings.lap_units = [...document.querySelectorAll(".readout .unit")].map((unit) => unit.textContent.trim());
    const drawn = [...document.querySelectorAll("[_echarts_instance_]")].map((e) => echarts.getInstanceByDom(e).getOption());
    const axes = drawn.flatMap((option) => [...(option.xAxis ?? []), ...(option.yAxis ?? [])]);
    findings.axes_in_g = axes.filter((axis) => /\(g\)$/.test(axis.name ?? "")).length;
    const bars = drawn.flatMap((option) => option.series).filter((series) => series.type === "bar");
    findings.greatest_bar = Math.max(...bars.flatMap((series) => series.data.map((d) => d?.value ?? d)));
    findings.switch = document.querySelector("header .units")?.textContent ?? null;
    findings.tables = document.querySelectorAll(".table table").length;

    const lap = document.querySelector(".chart.lap");
    if (lap) {
      const traces = lap.querySelector(".traces");
      const map = lap.querySelector(".map");
      const dot = () => {
        const mark = [...lap.querySelectorAll(".dot")].find((d) => !d.hidden);
        return mark ? mark.style.transform : null;
      };
      const readout = () => lap.querySelector(".readout").textContent;
      const places = [dot()];
      const said = [readout()];
      for (const share of [0.3, 0.7]) {
        traces.scrollIntoView();
        move(traces, 70 + share * (traces.clientWidth - 90), 90);
        await pause(120);
        places.push(dot());
        said.push(readout());
      }
      findings.dot_from_traces = places;
      findings.readouts_differ = new Set(said).size === said.length;
      if (map) {
        // From the dot's place on the map back to the traces: another place on the map, another distance.
        const canvas = map.querySelector("canvas");
        const before = lap.querySelector(".readout caption").textContent;
        for (
          let y = 20;
          y < canvas.clientHeight && lap.querySelector(".readout caption").textContent === before;
          y += 6
        ) {
          for (let x = 20; x < canvas.clientWidth; x += 6) move(map, x, y);
        }
        await pause(120);
        findings.map_to_traces = [before, lap.querySelector(".readout caption").textContent];
        const pixels = () => canvas.toDataURL();
        const whole = pixels();
        move(traces, 200, 90, ["mousedown"]);
        for (const x of [240, 280, 320]) move(traces, x, 90);
        move(traces, 320, 90, ["mouseup"]);
        await pause(200);
        findings.map_follows_zoom = pixels() !== whole;
      }
    }

    const table = [...document.querySelectorAll(".table table")].find((t) => t.querySelector("th.number"));
    if (table) {
      const heads = [...table.tHead.rows[0].cells];
      const column = heads.findIndex((head) => head.classList.contains("number"));
      const order = () =>
        [...table.tBodies[0].rows]
          .map((row) => Number(row.cells[column].dataset.value))
          .filter((v) => !Number.isNaN(v));
      heads[column].click();
      const up = order();
      heads[column].click();
      const down = order();
      findings.sorts =
        up.every((v, i) => i === 0 || v >= up[i - 1]) &&
        down.every((v, i) => i === 0 || v <= down[i - 1]) &&
        up.length > 0;
    }
    findings.scripts = document.scripts.length;
    findings.alerted = window.alerted === true;
  } catch (error) {
    faults.push(`the checks themselves: ${error.stack}`);
  }
  const written = document.createElement("pre");
  written.id = "findings";
  written.textContent = JSON.stringify(findings);
  document.body.append(written);
})();
