// Draws a figure into its place: what is shown of it, where that stands, and the marks themselves.
const figures = (() => {
  "use strict";

  const DASHES = ["", "7 4", "2 4", "7 3 2 3"];
  // Colors of series that a dark page would swallow.
  const ON_DARK = { "#0072B2": "#4FA8E0", "#000000": "#E8E8E8" };
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const [FONT_PX, TICK_PX, TOP_PX, RIGHT_PX] = [12, 5, 10, 14];
  // A line of more points than this has no marker at each of them.
  const MOST_MARKERS = 60;
  // The part of a category's slot that its bars fill, and the widest bar.
  const [FILLED, WIDEST_PX] = [0.78, 60];

  // Corners of the markers for a radius of one; the first, a circle, has none. Five shapes and
  // seven colors are coprime, so that 35 series differ.
  const SHAPES = [
    null,
    [
      [-0.9, -0.9],
      [0.9, -0.9],
      [0.9, 0.9],
      [-0.9, 0.9],
    ],
    [
      [0, -1.2],
      [1.1, 0.8],
      [-1.1, 0.8],
    ],
    [
      [0, -1.3],
      [1.2, 0],
      [0, 1.3],
      [-1.2, 0],
    ],
    [
      [-0.4, -1.2],
      [0.4, -1.2],
      [0.4, -0.4],
      [1.2, -0.4],
      [1.2, 0.4],
      [0.4, 0.4],
      [0.4, 1.2],
      [-0.4, 1.2],
      [-0.4, 0.4],
      [-1.2, 0.4],
      [-1.2, -0.4],
      [-0.4, -0.4],
    ],
  ];

  const fixed = (px) => String(Math.round(px * 100) / 100);

  // An element of a drawing. Words go in as text and are never read as markup.
  function drawn(name, attributes, ...inside) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) {
      element.setAttribute(key, typeof value === "number" ? fixed(value) : value);
    }
    element.append(...inside);
    return element;
  }

  // An element of the page.
  function made(name, className, ...inside) {
    const element = document.createElement(name);
    element.className = className;
    element.append(...inside);
    return element;
  }

  // Words at the axes.
  function words(x, y, anchor, said, more = {}) {
    return drawn("text", { class: "tick", x, y, "text-anchor": anchor, ...more }, said);
  }

  const pencil = document.createElement("canvas").getContext("2d");
  function widthOf(said) {
    pencil.font = `${FONT_PX}px ${getComputedStyle(document.body).fontFamily}`;
    return pencil.measureText(said).width;
  }

  // ---- What is drawn ----

  const categoriesOf = (figure) => figure.kind.bars?.categories;
  const isBanded = (figure) => figure.kind === "bands";
  const isJoined = (figure) => ["lines", "bands", "ways"].includes(figure.kind);
  const hasMarkers = (figure, series) =>
    figure.kind === "points" || (figure.kind === "lines" && series.points.length <= MOST_MARKERS);

  // A series in the measures of the axes; points without a place keep theirs, as gaps in a line.
  function measuredSeries(figure, series, index) {
    const [x, y] = [figure.x_scale, figure.y_scale];
    const points = series.points.map((told) => {
      const ends = (told.interval ?? []).map((end) => axes.measured(y, end));
      const hasEnds = ends.length === 2 && !ends.some(Number.isNaN);
      return {
        told,
        x: axes.measured(x, told.x),
        y: axes.measured(y, told.y),
        ends: hasEnds ? ends : null,
      };
    });
    return { index, name: series.name, points };
  }

  const isThere = (point) => !Number.isNaN(point.x) && !Number.isNaN(point.y);

  // The ranges of both axes that show all of these series.
  function wholeRanges(figure, shown, mostUp) {
    const points = shown.flatMap((series) => series.points).filter(isThere);
    const heights = points.flatMap((point) => [point.y, ...(point.ends ?? [])]);
    const names = categoriesOf(figure);
    // Bars begin at zero.
    if (names && figure.y_scale !== "log") heights.push(0);
    const nothing = [0, 1];
    const across = axes.extent(points.map((point) => point.x)) ?? nothing;
    const up = axes.extent(heights) ?? nothing;
    if (names)
      return { x: [-0.5, names.length - 0.5], y: axes.rounded(figure.y_scale, up, mostUp) };
    if (figure.kind === "ways") return { x: axes.padded(across, 0.04), y: axes.padded(up, 0.04) };
    const margin = shown.some((series) => hasMarkers(figure, series)) ? 0.04 : 0;
    return { x: axes.padded(across, margin), y: axes.rounded(figure.y_scale, up, mostUp) };
  }

  // One unit is as long on both axes: the range that has room to spare grows around its middle.
  function equalScales({ x, y }, area) {
    const unit = Math.max((x[1] - x[0]) / area.width, (y[1] - y[0]) / area.height);
    const grown = ([low, high], length) => {
      const [middle, half] = [(low + high) / 2, (unit * length) / 2];
      return [middle - half, middle + half];
    };
    return { x: grown(x, area.width), y: grown(y, area.height) };
  }

  // ---- Where it stands ----

  // The names under the slots of a bar chart: broken at spaces, or upright where a word is too
  // wide for its slot.
  function slotNames(names, room) {
    const isTooWide = (name) => name.split(" ").some((word) => widthOf(word) > room);
    if (!names.some(isTooWide)) {
      const lines = names.map((name) => brokenAt(name, room));
      return {
        upright: false,
        lines,
        height: Math.max(...lines.map((all) => all.length)) * 1.3 * FONT_PX,
      };
    }
    const lines = names.map((name) => [shortened(name, 140)]);
    return { upright: true, lines, height: Math.max(...lines.map(([name]) => widthOf(name))) + 4 };
  }

  function brokenAt(words, room) {
    const lines = [];
    for (const word of words.split(" ")) {
      const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
      if (lines.length && widthOf(longer) <= room) lines[lines.length - 1] = longer;
      else lines.push(word);
    }
    return lines;
  }

  function shortened(words, room) {
    if (widthOf(words) <= room) return words;
    const letters = [...words];
    while (letters.length && widthOf(`${letters.join("")}\u2026`) > room) letters.pop();
    return `${letters.join("")}\u2026`;
  }

  // Area, axes and names of the figure in so much room.
  function laidOut(chart, width) {
    const { figure } = chart;
    const names = categoriesOf(figure);
    const isSquare = figure.kind === "ways";
    const height = isSquare ? Math.min(width, 620) : Math.min(Math.max(0.55 * width, 260), 400);
    const mostUp = Math.min(Math.max(Math.floor(height / 50), 2), 10);
    const shown = chart.series.filter((series) => !chart.hidden.has(series.index));
    const whole = wholeRanges(figure, shown.length ? shown : chart.series, mostUp);
    const ranges = { ...whole, ...chart.zoom };
    const area = { left: 0, top: TOP_PX, width: 0, height };
    // Labels need room at the left, which changes equal scales, and with them the labels.
    for (let k = 0; k < (isSquare ? 2 : 1); k += 1) {
      const y = isSquare && k ? equalScales(ranges, area).y : ranges.y;
      const labels = axes.ticks(figure.y_scale, y, mostUp).major.map((tick) => widthOf(tick.label));
      area.left = Math.ceil(Math.max(...labels, 8) + TICK_PX + 6);
      area.width = Math.max(width - area.left - RIGHT_PX, 60);
    }
    const { x, y } = isSquare ? equalScales(ranges, area) : ranges;
    const slots = names ? slotNames(names, area.width / names.length - 6) : null;
    return {
      area,
      x,
      y,
      slots,
      shown,
      width,
      height: TOP_PX + height + TICK_PX + (slots?.height ?? 1.3 * FONT_PX) + 6,
      xTicks: names ? null : ticksAcross(figure, shown, x, area, !chart.zoom),
      yTicks: axes.ticks(figure.y_scale, y, mostUp),
      toX: (m) => area.left + ((m - x[0]) / (x[1] - x[0])) * area.width,
      toY: (m) => area.top + area.height - ((m - y[0]) / (y[1] - y[0])) * area.height,
    };
  }

  function ticksAcross(figure, shown, range, area, isWhole) {
    const most = Math.min(Math.max(Math.floor(area.width / 70), 2), 12);
    if (isWhole && ["lines", "bands"].includes(figure.kind)) {
      const values = shown.flatMap((series) =>
        series.points.filter(isThere).map((point) => point.told.x),
      );
      const given = axes.ticksAt(figure.x_scale, values, range);
      const room = (tick) => widthOf(tick.label) + 8;
      const needed = given?.major.reduce((sum, tick) => sum + room(tick), 0) ?? Infinity;
      if (needed < area.width) return given;
    }
    return axes.ticks(figure.x_scale, range, most);
  }

  // Every point that has a place, in pixels; what is drawn and what answers the pointer.
  function placed(chart, layout) {
    const count = Math.max(layout.shown.length, 1);
    const slot = categoriesOf(chart.figure)
      ? layout.area.width / categoriesOf(chart.figure).length
      : 0;
    const width = Math.min((slot * FILLED) / count, WIDEST_PX);
    return layout.shown.map((series, order) => {
      // From the middle of the slot to the middle of this series' bar.
      const aside = (order - (count - 1) / 2) * width;
      const points = series.points.map(
        (point) =>
          isThere(point) && {
            series,
            told: point.told,
            width,
            x: layout.toX(point.x) + (slot ? aside : 0),
            y: layout.toY(point.y),
            ends: point.ends?.map(layout.toY),
          },
      );
      return { series, points };
    });
  }

  // ---- Drawing ----

  function frame(chart, { area, slots, xTicks, yTicks, toX, toY }) {
    const [right, bottom] = [area.left + area.width, area.top + area.height];
    const group = drawn("g", { class: "frame" });
    const line = (kind, x1, y1, x2, y2) =>
      group.append(drawn("line", { class: kind, x1, y1, x2, y2 }));
    for (const { at, label } of yTicks.major) {
      line("grid", area.left, toY(at), right, toY(at));
      line("axis", area.left - TICK_PX, toY(at), area.left, toY(at));
      group.append(words(area.left - TICK_PX - 3, toY(at) + 0.36 * FONT_PX, "end", label));
    }
    for (const { at } of yTicks.minor) line("axis", area.left - 3, toY(at), area.left, toY(at));
    let free = 0;
    for (const { at, label } of xTicks?.major ?? []) {
      line("grid", toX(at), area.top, toX(at), bottom);
      line("axis", toX(at), bottom, toX(at), bottom + TICK_PX);
      const half = widthOf(label) / 2;
      // A label at the right end stays in the picture; one that would touch another is not written.
      const x = Math.min(toX(at), right + RIGHT_PX - half);
      if (x - half < free) continue;
      free = x + half + 6;
      group.append(words(x, bottom + TICK_PX + FONT_PX, "middle", label));
    }
    for (const { at } of xTicks?.minor ?? []) line("axis", toX(at), bottom, toX(at), bottom + 3);
    if (slots) group.append(...slotLabels(slots, toX, bottom + TICK_PX));
    line("axis", area.left, area.top, area.left, bottom);
    line("axis", area.left, bottom, right, bottom);
    return group;
  }

  function slotLabels({ upright, lines }, toX, top) {
    return lines.flatMap((all, k) =>
      all.map((said, row) => {
        if (!upright) return words(toX(k), top + FONT_PX * (1 + 1.3 * row), "middle", said);
        const x = toX(k) + 0.36 * FONT_PX;
        return words(x, top, "end", said, { transform: `rotate(-90 ${fixed(x)} ${fixed(top)})` });
      }),
    );
  }

  // The stretches of points between the gaps.
  function runs(points, isIn) {
    const all = [[]];
    for (const point of points) {
      if (point && isIn(point)) all.at(-1).push(point);
      else if (all.at(-1).length) all.push([]);
    }
    return all.filter((run) => run.length > 1);
  }

  // A path through places; those less than half a pixel from the one before are not seen.
  function pathThrough(places) {
    let last = null;
    const parts = [];
    places.forEach(([x, y], k) => {
      if (last && k < places.length - 1 && Math.hypot(x - last[0], y - last[1]) < 0.5) return;
      parts.push(`${last ? "L" : "M"}${fixed(x)} ${fixed(y)}`);
      last = [x, y];
    });
    return parts.join("");
  }

  function marker(index, x, y, radius, look) {
    const corners = SHAPES[index % SHAPES.length];
    if (!corners) return drawn("circle", { cx: x, cy: y, r: radius, ...look });
    const at = ([dx, dy]) => `${fixed(x + dx * radius)} ${fixed(y + dy * radius)}`;
    return drawn("path", { d: `M${corners.map(at).join("L")}Z`, ...look });
  }

  function errorBar({ x, ends: [low, high] }, half, look) {
    const d =
      `M${fixed(x)} ${fixed(low)}V${fixed(high)}` +
      [low, high].map((end) => `M${fixed(x - half)} ${fixed(end)}H${fixed(x + half)}`).join("");
    return drawn("path", { class: "interval", d, ...look });
  }

  const colorOf = ({ colors }, index) => {
    const color = colors[index % colors.length];
    return (dark.matches && ON_DARK[color]) || color;
  };
  const dashOf = ({ colors }, index) => DASHES[Math.floor(index / colors.length) % DASHES.length];

  // What fills a bar; where colors repeat, bars differ in their opacity and have a rim.
  const fillOf = (chart, index) => {
    const round = Math.floor(index / chart.colors.length);
    const fill = colorOf(chart, index);
    if (round === 0) return { fill };
    return { fill, "fill-opacity": round === 1 ? 0.5 : 0.15, stroke: "currentColor" };
  };

  function seriesMarks(chart, { series, points }, layout) {
    const { figure } = chart;
    const color = colorOf(chart, series.index);
    const there = points.filter(Boolean);
    const sure = there.filter((point) => point.ends);
    const group = drawn("g", { class: "series" });
    if (categoriesOf(figure)) {
      group.append(...bars(there, sure, layout, figure.y_scale === "log", fillOf(chart, series.index)));
      return group;
    }
    if (isBanded(figure)) group.append(...bands(points, color));
    if (isJoined(figure)) group.append(...lines(points, color, dashOf(chart, series.index)));
    if (figure.kind === "ways" && there.length > 1) group.append(...wayEnds(there, color));
    if (!isBanded(figure)) group.append(...sure.map((p) => errorBar(p, 4, { stroke: color })));
    if (hasMarkers(figure, series)) {
      const look = { class: "marker", fill: color };
      group.append(...there.map((p) => marker(series.index, p.x, p.y, 4, look)));
    }
    return group;
  }

  function bands(points, fill) {
    return runs(points, (point) => point.ends).map((run) => {
      const [lower, upper] = [0, 1].map((k) => run.map((point) => [point.x, point.ends[k]]));
      const d = `${pathThrough([...upper, ...lower.reverse()])}Z`;
      return drawn("path", { class: "band", d, fill });
    });
  }

  function lines(points, stroke, dash) {
    return runs(points, () => true).map((run) => {
      const d = pathThrough(run.map((point) => [point.x, point.y]));
      return drawn("path", { class: "line", d, stroke, "stroke-dasharray": dash });
    });
  }

  // A ring where a way starts, and an arrowhead where it ends.
  function wayEnds(there, color) {
    const [start, end] = [there[0], there.at(-1)];
    const ring = drawn("circle", { class: "start", cx: start.x, cy: start.y, r: 3.5, stroke: color });
    const before = there.findLast((p) => Math.hypot(end.x - p.x, end.y - p.y) > 0.5);
    if (!before) return [ring];
    const far = Math.hypot(end.x - before.x, end.y - before.y);
    const [ux, uy] = [(9 * (end.x - before.x)) / far, (9 * (end.y - before.y)) / far];
    const wing = (side) => `${fixed(end.x - ux + side * 0.5 * uy)} ${fixed(end.y - uy - side * 0.5 * ux)}`;
    const d = `M${wing(1)}L${fixed(end.x)} ${fixed(end.y)}L${wing(-1)}Z`;
    return [ring, drawn("path", { class: "end", d, fill: color })];
  }

  // Bars from zero, or from the low end of a logarithmic axis, and the line that they stand on.
  function bars(there, sure, { area, y, toY }, isLog, look) {
    const foot = toY(isLog ? y[0] : Math.max(y[0], 0));
    const half = Math.min(0.2 * (there[0]?.width ?? 0), 5);
    const ends = { x1: area.left, y1: foot, x2: area.left + area.width, y2: foot };
    return [
      ...there.map((point) => bar(point, foot, look)),
      ...sure.map((point) => errorBar(point, half, { class: "interval ink" })),
      drawn("line", { class: "axis", ...ends }),
    ];
  }

  function bar({ x, y, width }, base, look) {
    const filled = width - Math.min(0.06 * width, 1.5);
    const box = {
      x: x - filled / 2,
      y: Math.min(y, base),
      width: filled,
      height: Math.abs(base - y),
    };
    return drawn("rect", { class: "bar", ...look, ...box });
  }

  // Draws the figure anew, for its width, its zoom and the series that are switched on.
  function draw(chart) {
    const width = chart.stage.clientWidth;
    if (width === 0) return;
    const layout = laidOut(chart, width);
    const marks = placed(chart, layout);
    const { area } = layout;
    const clip = `${chart.id}-area`;
    // A mark at the end of an axis is seen as a whole; of a part only what lies in it.
    const slack = chart.zoom ? 1 : 6;
    const box = {
      x: area.left - slack,
      y: area.top - slack,
      width: area.width + 2 * slack,
      height: area.height + 2 * slack,
    };
    const data = drawn(
      "g",
      { "clip-path": `url(#${clip})` },
      ...marks.map((each) => seriesMarks(chart, each, layout)),
    );
    const rect = drawn("rect", { class: "selection", visibility: "hidden" });
    const spot = drawn("g", { class: "spot" });
    const whole = `0 0 ${fixed(width)} ${fixed(layout.height)}`;
    for (const [key, value] of Object.entries({ viewBox: whole, width, height: layout.height })) {
      chart.svg.setAttribute(key, typeof value === "number" ? fixed(value) : value);
    }
    chart.svg.replaceChildren(
      drawn("clipPath", { id: clip }, drawn("rect", box)),
      frame(chart, layout),
      data,
      spot,
      rect,
    );
    chart.below.style.paddingLeft = `${fixed(area.left)}px`;
    chart.reset.style.visibility = chart.zoom ? "visible" : "hidden";
    Object.assign(chart, { layout, marks, spot, rect, drawnWidth: width });
    chart.tip.hidden = true;
  }

  // What a series looks like, two letters wide.
  function swatch(chart, series) {
    const { figure } = chart;
    const color = colorOf(chart, series.index);
    const picture = drawn("svg", {
      class: "swatch",
      width: 24,
      height: 12,
      viewBox: "0 0 24 12",
      "aria-hidden": "true",
    });
    if (categoriesOf(figure))
      picture.append(drawn("rect", { x: 2, y: 1, width: 20, height: 10, ...fillOf(chart, series.index) }));
    if (isBanded(figure))
      picture.append(
        drawn("rect", { class: "band", x: 0, y: 0, width: 24, height: 12, fill: color }),
      );
    if (isJoined(figure))
      picture.append(
        drawn("path", {
          class: "line",
          d: "M0 6H24",
          stroke: color,
          "stroke-dasharray": dashOf(chart, series.index),
        }),
      );
    if (hasMarkers(figure, series))
      picture.append(marker(series.index, 12, 6, 4, { class: "marker", fill: color }));
    return picture;
  }

  // A figure as the page tells it, with all of its series in the measures of its axes.
  function read(place) {
    const { figure, colors } = JSON.parse(place.querySelector("script").textContent);
    const series = figure.series.map((each, index) => measuredSeries(figure, each, index));
    return { id: place.id, figure, colors, series, zoom: null, hidden: new Set() };
  }

  return { read, draw, drawn, made, fixed, marker, swatch, colorOf, categoriesOf };
})();
