// Lets figures answer the mouse: values of the nearest mark, zoom, and series switched off and on.
// Without it the page shows the still form of every figure.
(() => {
  "use strict";

  const { draw, drawn, made, fixed, marker, swatch, colorOf, categoriesOf } = figures;
  // Of the pointer: points farther away are not told about.
  const REACH_PX = 40;
  // Shorter drags are clicks, or go along the other axis alone.
  const DRAG_PX = 8;

  const isInside = ({ left, top, width, height }, [x, y], slack = 0) =>
    x >= left - slack && x <= left + width + slack && y >= top - slack && y <= top + height + slack;

  // How far a mark is from the pointer; a bar is near from its foot to its end.
  function distance(chart, point, [x, y]) {
    if (!categoriesOf(chart.figure)) return Math.hypot(point.x - x, point.y - y);
    const foot = chart.layout.area.top + chart.layout.area.height;
    const aside = Math.max(Math.abs(point.x - x) - point.width / 2, 0);
    const above = Math.max(Math.min(point.y, foot) - y, y - Math.max(point.y, foot), 0);
    return Math.hypot(aside, above);
  }

  function nearest(chart, at) {
    const { area } = chart.layout;
    // A bar is seen although its end lies beyond the area; a point is not.
    const isBars = Boolean(categoriesOf(chart.figure));
    const isSeen = (point) => point && isInside(area, [point.x, isBars ? area.top : point.y], 1);
    const seen = chart.marks.flatMap(({ points }) => points).filter(isSeen);
    let [best, least] = [null, REACH_PX];
    for (const point of seen) {
      const far = distance(chart, point, at);
      if (far < least) [best, least] = [point, far];
    }
    return best;
  }

  function tellNothing(chart) {
    chart.tip.hidden = true;
    chart.spot.replaceChildren();
  }

  // Shows a point's values beside it.
  function tell(chart, point) {
    const { told, series } = point;
    const { digits } = axes;
    const names = categoriesOf(chart.figure);
    const across = names ? (names[told.x] ?? "") : digits(told.x);
    const between = point.ends ? ` [${told.interval.map(digits).join(", ")}]` : "";
    const then = chart.figure.kind === "ways" ? ", " : ": ";
    const lines = [made("div", "", across + then, made("strong", "", digits(told.y)), between)];
    if (series.name !== "") lines.unshift(made("div", "name", swatch(chart, series), series.name));
    if (told.n !== undefined) lines.push(made("div", "", `n = ${told.n}`));
    chart.tip.replaceChildren(...lines);
    chart.tip.hidden = false;
    const color = colorOf(chart, series.index);
    const { area } = chart.layout;
    const y = Math.max(point.y, area.top);
    if (names)
      chart.spot.replaceChildren(drawn("circle", { cx: point.x, cy: y, r: 4, fill: color }));
    else chart.spot.replaceChildren(marker(series.index, point.x, y, 6, { fill: color }));
    // Above the point, or below it where there is no room; never beyond the figure's sides.
    const [wide, high] = [chart.tip.offsetWidth, chart.tip.offsetHeight];
    const left = Math.min(Math.max(point.x - wide / 2, 0), Math.max(chart.layout.width - wide, 0));
    const above = y - high - 12;
    chart.tip.style.left = `${fixed(left)}px`;
    chart.tip.style.top = `${fixed(above < -20 ? y + 14 : above)}px`;
  }

  // The range between two places in pixels, or null where they are too near for one.
  function between(from, to, start, length, [low, high]) {
    if (Math.abs(to - from) < DRAG_PX) return null;
    const measure = (px) =>
      low + (Math.min(Math.max(px - start, 0), length) / length) * (high - low);
    const range = [measure(Math.min(from, to)), measure(Math.max(from, to))];
    // Beyond this numbers cannot tell places apart.
    const size = Math.max(Math.abs(range[0]), Math.abs(range[1]));
    return range[1] - range[0] > 1e-9 * size ? range : null;
  }

  function zoomed(chart, [x1, y1], [x2, y2]) {
    const { area, x, y } = chart.layout;
    const bottom = area.top + area.height;
    const across = categoriesOf(chart.figure) ? null : between(x1, x2, area.left, area.width, x);
    const up = between(bottom - y1, bottom - y2, 0, area.height, y);
    if (!across && !up) return;
    chart.zoom = { x: across ?? x, y: up ?? y };
    draw(chart);
  }

  function showSelection(chart, [x1, y1], [x2, y2]) {
    const { area } = chart.layout;
    const clamped = (px, start, length) => Math.min(Math.max(px, start), start + length);
    const side = (a, b, start, length, isWhole) =>
      isWhole
        ? [start, start + length]
        : [Math.min(a, b), Math.max(a, b)].map((px) => clamped(px, start, length));
    const isBars = Boolean(categoriesOf(chart.figure));
    const [left, right] = side(
      x1,
      x2,
      area.left,
      area.width,
      isBars || Math.abs(x2 - x1) < DRAG_PX,
    );
    const [top, bottom] = side(y1, y2, area.top, area.height, Math.abs(y2 - y1) < DRAG_PX);
    const box = {
      x: left,
      y: top,
      width: right - left,
      height: bottom - top,
      visibility: "visible",
    };
    for (const [key, value] of Object.entries(box)) chart.rect.setAttribute(key, value);
  }

  // Follows the pointer from where it was pressed to where it is let go, inside the figure or not.
  function drag(chart, from, at) {
    chart.isDragged = true;
    tellNothing(chart);
    const moved = (event) => {
      const to = at(event);
      const isShort = Math.hypot(to[0] - from[0], to[1] - from[1]) < DRAG_PX;
      if (!isShort) showSelection(chart, from, to);
    };
    const ended = (event) => {
      window.removeEventListener("pointermove", moved);
      window.removeEventListener("pointerup", ended);
      window.removeEventListener("pointercancel", ended);
      chart.isDragged = false;
      chart.rect.setAttribute("visibility", "hidden");
      if (event.type === "pointerup") zoomed(chart, from, at(event));
    };
    window.addEventListener("pointermove", moved);
    window.addEventListener("pointerup", ended);
    window.addEventListener("pointercancel", ended);
  }

  function answerMouse(chart) {
    const { svg } = chart;
    const at = (event) => {
      const box = svg.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const hover = (event) => {
      if (chart.isDragged) return;
      const point = nearest(chart, at(event));
      if (point) tell(chart, point);
      else tellNothing(chart);
    };
    svg.addEventListener("pointermove", hover);
    svg.addEventListener("pointerleave", () => tellNothing(chart));
    svg.addEventListener("pointerdown", (event) => {
      // A finger scrolls the page, and tells about what it touches.
      if (event.pointerType === "touch") hover(event);
      else if (event.button === 0 && !chart.isDragged && isInside(chart.layout.area, at(event))) {
        event.preventDefault();
        drag(chart, at(event), at);
      }
    });
    const whole = () => {
      chart.zoom = null;
      draw(chart);
    };
    svg.addEventListener("dblclick", whole);
    chart.reset.addEventListener("click", whole);
  }

  function fillLegend(chart) {
    const named = chart.series.filter((series) => series.name !== "");
    chart.legend.hidden = named.length === 0;
    chart.legend.replaceChildren(
      ...named.map((series) => {
        const button = made(
          "button",
          "entry",
          swatch(chart, series),
          made("span", "", series.name),
        );
        button.type = "button";
        button.setAttribute("aria-pressed", String(!chart.hidden.has(series.index)));
        button.addEventListener("click", () => {
          const isHidden = chart.hidden.delete(series.index);
          if (!isHidden) chart.hidden.add(series.index);
          button.setAttribute("aria-pressed", String(isHidden));
          draw(chart);
        });
        return button;
      }),
    );
  }

  function begun(place) {
    const known = figures.read(place);
    const { figure } = known;
    const stage = place.querySelector(".drawn");
    const reset = made("button", "reset", "Reset zoom");
    reset.type = "button";
    const still = place.querySelector(".still");
    const svg = drawn("svg", {
      class: "chart",
      role: "img",
      "aria-label": still?.alt ?? figure.title,
    });
    const chart = {
      ...known,
      stage,
      reset,
      svg,
      legend: made("div", "legend"),
      tip: made("div", "tip"),
      below: made("div", "x-label", figure.x_label),
      isDragged: false,
    };
    const above = made("div", "above", made("span", "", figure.y_label), reset);
    stage.classList.toggle("square", figure.kind === "ways");
    stage.replaceChildren(chart.legend, above, made("div", "canvas", svg, chart.tip), chart.below);
    stage.hidden = false;
    fillLegend(chart);
    draw(chart);
    answerMouse(chart);
    if (still) still.hidden = true;
    return chart;
  }

  const charts = [];
  for (const place of document.querySelectorAll("figure.plot")) {
    try {
      charts.push(begun(place));
    } catch (error) {
      // The still form stays.
      place.querySelector(".drawn").hidden = true;
      reportError(error);
    }
  }
  document.documentElement.dataset.drawn = String(charts.length);

  const resized = new ResizeObserver(() =>
    // In a frame of its own: drawing changes heights, which the observer would have to report again.
    requestAnimationFrame(() =>
      charts.forEach((chart) => {
        if (chart.stage.clientWidth !== chart.drawnWidth) draw(chart);
      }),
    ),
  );
  charts.forEach((chart) => resized.observe(chart.stage));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    charts.forEach((chart) => {
      fillLegend(chart);
      draw(chart);
    }),
  );
})();
