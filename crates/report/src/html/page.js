// Draws figures from the data beside them, and sorts tables. Without it the page shows the still
// form of every figure, and tables in their own order.
(() => {
  "use strict";

  const DASHES = ["solid", "dash", "dot", "dashdot"];
  // Colors of series that a dark page would swallow.
  const ON_DARK = { "#0072B2": "#4FA8E0", "#000000": "#E8E8E8" };
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const digits = (value) => Number(value.toPrecision(5)).toString();

  function looks() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    return { ink: of("--ink"), faint: of("--faint"), line: of("--line"), paper: of("--paper") };
  }

  function hover(point) {
    const interval = point.interval;
    const range = interval ? ` [${digits(interval[0])}, ${digits(interval[1])}]` : "";
    const runs = point.n === undefined ? "" : `<br>n = ${point.n}`;
    return digits(point.y) + range + runs;
  }

  function faded(color, part) {
    const [r, g, b] = [1, 3, 5].map((k) => parseInt(color.slice(k, k + 2), 16));
    return `rgba(${r}, ${g}, ${b}, ${part})`;
  }

  // Names are text, not markup: Plotly reads some tags in them.
  const plain = (name) => name.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

  function errorBars(points, color) {
    if (!points.some((p) => p.interval)) return undefined;
    const length = (p, k) => (p.interval ? Math.abs(p.interval[k] - p.y) : 0);
    const [array, arrayminus] = [1, 0].map((k) => points.map((p) => length(p, k)));
    return { type: "data", symmetric: false, array, arrayminus, color, thickness: 1.2, width: 4 };
  }

  function band(points, color, group) {
    const sure = points.filter((p) => p.interval);
    const back = sure.slice().reverse();
    return {
      type: "scatter", mode: "lines", fill: "toself", fillcolor: faded(color, 0.2),
      x: [...sure, ...back].map((p) => p.x),
      y: [...sure.map((p) => p.interval[1]), ...back.map((p) => p.interval[0])],
      line: { width: 0 }, hoverinfo: "skip", showlegend: false, legendgroup: group,
    };
  }

  function traces(figure, colors) {
    const kind = typeof figure.kind === "string" ? figure.kind : "bars";
    return figure.series.flatMap((series, index) => {
      const color = colors[index % colors.length];
      const points = series.points;
      const group = `series-${index}`;
      const name = plain(series.name);
      const shared = {
        name, legendgroup: group, showlegend: name !== "", y: points.map((p) => p.y),
        text: points.map(hover), textposition: "none", marker: { color, size: 7 },
        hovertemplate: `%{x}: %{text}<extra>${name}</extra>`,
      };
      if (kind === "bars") {
        const names = figure.kind.bars.categories;
        const x = points.map((p) => plain(names[p.x] ?? ""));
        return [{ ...shared, type: "bar", x, error_y: errorBars(points, looks().ink) }];
      }
      const joined = kind === "points" ? "markers" : points.length > 60 ? "lines" : "lines+markers";
      const dash = DASHES[Math.floor(index / colors.length) % DASHES.length];
      const line = {
        ...shared, type: "scatter", x: points.map((p) => p.x), line: { color, dash, width: 2 },
        mode: kind === "bands" || kind === "ways" ? "lines" : joined,
      };
      if (kind === "bands") return [band(points, color, group), line];
      return [{ ...line, error_y: errorBars(points, faded(color, 0.7)) }];
    });
  }

  // Ticks where there are values, if they are few and far enough apart to be read.
  function ticksAtValues(figure) {
    const all = figure.series.flatMap((s) => s.points.map((p) => p.x));
    const values = [...new Set(all)].sort((a, b) => a - b);
    const places = figure.x_scale === "log" ? values.map(Math.log10) : values;
    const span = places.at(-1) - places[0];
    const gaps = places.slice(1).map((place, k) => (place - places[k]) / span);
    const fits = values.length > 1 && values.length < 11 && Math.min(...gaps) > 0.07;
    return fits ? { tickmode: "array", tickvals: values, ticktext: values.map(digits) } : {};
  }

  // A tick for each power of ten, and between them only where there are few.
  function logTicks(values) {
    const sizes = values.filter((value) => value > 0);
    const wide = Math.max(...sizes) / Math.min(...sizes) > 100;
    return { dtick: wide ? 1 : "D2" };
  }

  function layout(figure) {
    const look = looks();
    const axis = (label, scale) => ({
      title: { text: plain(label), font: { size: 13 } }, type: scale, automargin: true,
      gridcolor: look.line, zerolinecolor: look.line, linecolor: look.faint, ticks: "outside",
      tickcolor: look.faint, exponentformat: "power", minexponent: 5,
    });
    const isBars = typeof figure.kind !== "string";
    const points = figure.series.flatMap((s) => s.points);
    const x = axis(figure.x_label, figure.x_scale);
    const y = axis(figure.y_label, figure.y_scale);
    if (figure.x_scale === "log") Object.assign(x, logTicks(points.map((p) => p.x)));
    if (figure.y_scale === "log") Object.assign(y, logTicks(points.map((p) => p.y)));
    if (isBars) x.type = "category";
    if (figure.kind === "lines" || figure.kind === "bands") Object.assign(x, ticksAtValues(figure));
    if (figure.kind === "ways") y.scaleanchor = "x";
    const named = figure.series.filter((s) => s.name !== "").length;
    return {
      xaxis: x, yaxis: y, barmode: "group", hovermode: "closest",
      showlegend: named > 0,
      // Above the figure, so that narrow screens keep their width for the data.
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 12 } },
      margin: { l: 10, r: 15, t: 10, b: 10 },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: look.ink },
      hoverlabel: { bgcolor: look.paper, bordercolor: look.faint, font: { color: look.ink } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: look.faint, activecolor: look.ink },
    };
  }

  function draw(place) {
    const { figure, colors } = JSON.parse(place.querySelector("script").textContent);
    const shown = colors.map((color) => (dark.matches && ON_DARK[color]) || color);
    const still = place.querySelector(".still");
    const drawn = place.querySelector(".drawn");
    drawn.hidden = false;
    drawn.classList.toggle("square", figure.kind === "ways");
    const options = {
      responsive: true, displaylogo: false,
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
      toImageButtonOptions: { format: "svg", filename: place.id },
    };
    return window.Plotly.react(drawn, traces(figure, shown), layout(figure), options).then(
      () => { if (still) still.hidden = true; },
      (error) => { drawn.hidden = true; throw error; },
    );
  }

  function drawAll() {
    if (!window.Plotly) return;
    const places = [...document.querySelectorAll("figure.plot")];
    Promise.all(places.map(draw)).then(() => {
      document.documentElement.dataset.drawn = String(places.length);
    });
  }

  // The number that a cell begins with, `1 234.5 [1 200, 1 300]` or `-`; NaN where there is none.
  function leading(cell) {
    const found = cell.trim().replaceAll("\u2212", "-").match(/^[-+]?\d+( \d{3})*(\.\d+)?(e[-+]?\d+)?/i);
    return found ? Number(found[0].replaceAll(" ", "")) : NaN;
  }

  const words = new Intl.Collator("en", { numeric: true });

  function compare(a, b) {
    const [x, y] = [leading(a), leading(b)];
    if (!Number.isNaN(x) && !Number.isNaN(y)) return x - y || words.compare(a, b);
    if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
    return words.compare(a, b);
  }

  function sortable(table) {
    const body = table.tBodies[0];
    const rows = [...body.rows];
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const order = { none: "ascending", ascending: "descending", descending: "none" };
        const next = order[head.getAttribute("aria-sort") ?? "none"];
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        const sorted = rows.slice();
        if (next !== "none") {
          head.setAttribute("aria-sort", next);
          const sign = next === "ascending" ? 1 : -1;
          const cell = (row) => row.cells[column].textContent;
          const empty = (row) => cell(row) === "" || cell(row) === "-";
          // What is missing stays last, either way.
          sorted.sort((a, b) => empty(a) - empty(b) || sign * compare(cell(a), cell(b)));
        }
        body.append(...sorted);
      });
    });
  }

  document.querySelectorAll("table.sortable").forEach(sortable);
  drawAll();
  dark.addEventListener("change", drawAll);
})();
