// Shows the values of the mark of a figure that is nearest to the pointer. Without it the page has the same figures, and
// their numbers below them.
(() => {
  "use strict";

  // Of the pointer, in pixels of the drawing: marks farther away say nothing.
  const REACH_PX = 30;

  // A number with six digits, which tell any two measurements apart.
  const digits = (value) => String(Number(value.toPrecision(6))).replace("-", "\u2212");

  const made = (tag, ...inside) => {
    const element = document.createElement(tag);
    element.append(...inside);
    return element;
  };

  // The names of positions, where these are numbers of names.
  function namesOf({ kind }) {
    const inside = Object.values(kind)[0];
    return typeof kind === "string" ? null : (inside.categories ?? inside.rows ?? inside.columns);
  }

  // What the figure says about a mark, in lines.
  function lines(figure, [, , s, p]) {
    const series = figure.series[s];
    const names = namesOf(figure);
    const point = names ? series.points.find(({ x }) => x === p) : series.points[p];
    if (!point) return [];
    const isRuns = figure.kind.runs !== undefined;
    const x = names ? names[p] : (isRuns ? "replicate " : "") + digits(point.x);
    const ends = point.interval ? ` [${point.interval.map(digits).join(", ")}]` : "";
    const value = made("div", `${x}: `, made("strong", digits(point.y)), ends);
    const told = series.name === "" ? [value] : [made("div", series.name), value];
    const words = figure.kind.forest?.texts[s]?.[p];
    if (words) told.push(made("div", words));
    if (point.n !== undefined) told.push(made("div", `n = ${point.n}`));
    return told;
  }

  function follow(plot) {
    const canvas = plot.querySelector(".canvas");
    const svg = canvas.querySelector("svg");
    const { figure, spots } = JSON.parse(plot.querySelector('script[type="application/json"]').text);
    const tip = made("div");
    tip.className = "tip";
    tip.hidden = true;
    canvas.append(tip);
    const ring = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    ring.setAttribute("class", "ring");
    ring.setAttribute("r", "7");
    ring.setAttribute("visibility", "hidden");
    svg.append(ring);

    function leave() {
      tip.hidden = true;
      ring.setAttribute("visibility", "hidden");
    }

    function tell(event) {
      const box = svg.getBoundingClientRect();
      const scale = svg.viewBox.baseVal.width / box.width;
      const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
      let [best, least] = [null, REACH_PX];
      for (const spot of spots) {
        const far = Math.hypot(spot[0] - x, spot[1] - y);
        if (far < least) [best, least] = [spot, far];
      }
      if (!best) return leave();
      tip.replaceChildren(...lines(figure, best));
      tip.hidden = false;
      ring.setAttribute("cx", best[0]);
      ring.setAttribute("cy", best[1]);
      ring.setAttribute("visibility", "visible");
      // Above the mark, or below it where there is no room; never beyond the sides of the figure.
      const [left, top] = [best[0] / scale, best[1] / scale];
      const room = Math.max(canvas.clientWidth - tip.offsetWidth, 0);
      const above = top - tip.offsetHeight - 12;
      tip.style.left = `${Math.min(Math.max(left - tip.offsetWidth / 2, 0), room)}px`;
      tip.style.top = `${above < 0 ? top + 14 : above}px`;
    }

    svg.addEventListener("pointermove", tell);
    svg.addEventListener("pointerdown", tell);
    svg.addEventListener("pointerleave", leave);
  }

  const plots = [...document.querySelectorAll("figure.plot")];
  plots.forEach(follow);
  document.documentElement.dataset.drawn = String(plots.length);
})();
