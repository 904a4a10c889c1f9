// Begins before the page does. What it finds becomes a JSON script at the end of the page.
(() => {
  const found = { errors: [], violations: [], requests: [] };
  addEventListener("error", (event) => found.errors.push(event.message));
  addEventListener("unhandledrejection", (event) => found.errors.push(String(event.reason)));
  addEventListener("securitypolicyviolation", (event) =>
    found.violations.push(`${event.violatedDirective} ${event.blockedURI}`));
  const all = (selector) => [...document.querySelectorAll(selector)];
  const later = (ms) => new Promise((done) => setTimeout(done, ms));

  async function press(element) {
    const box = element.getBoundingClientRect();
    const at = { bubbles: true, cancelable: true, clientX: box.x + 2, clientY: box.y + 2 };
    for (const kind of ["mousemove", "mousedown", "mouseup", "click"]) {
      element.dispatchEvent(new MouseEvent(kind, at));
    }
    // A legend waits whether a second click follows.
    await later(1000);
  }

  async function look() {
    const plots = all(".plot .drawn");
    for (let k = 0; k < 300 && all(".plot").length !== Number(document.documentElement.dataset.drawn ?? 0); k += 1) {
      await later(100);
    }
    found.figures = all("figure.plot").length;
    found.drawn = plots.filter((plot) => plot.querySelector(".main-svg")).length;
    found.stills_shown = all(".plot .still").filter((still) => !still.hidden).length;
    found.traces = plots.map((plot) => plot.data?.length ?? 0);
    found.pictures = all(".picture img").map((picture) => picture.naturalWidth);
    found.tables = all("table").length;
    found.captions = all("caption").map((caption) => caption.textContent);
    found.heads = all("h1, h2").map((head) => head.textContent);
    found.badges = all("tbody .badge").map((badge) => badge.textContent);
    found.words = document.querySelector("main").innerText;
    found.wider_than_window = document.documentElement.scrollWidth > innerWidth;

    const table = document.querySelector("table.sortable");
    if (table) {
      const column = () => [...table.tBodies[0].rows].map((row) => row.cells[0].textContent);
      const button = table.tHead.querySelector("button");
      found.sorted = [column()];
      for (let k = 0; k < 3; k += 1) {
        button.click();
        found.sorted.push(column());
      }
    }
    const plot = plots.find((each) => each.data?.length > 1 && each.querySelector(".legendtoggle"));
    if (plot) {
      const point = plot.data.findIndex((trace) => trace.x.length > 0);
      window.Plotly.Fx.hover(plot, [{ curveNumber: point, pointNumber: 0 }]);
      await later(300);
      found.hover = plot.querySelector(".hoverlayer")?.textContent ?? "";
      await press(plot.querySelector(".legendtoggle"));
      found.hidden_by_legend = plot.data.filter((trace) => trace.visible === "legendonly").length;
      await window.Plotly.relayout(plot, { "xaxis.range": [0, 1] });
      found.zoomed = plot.layout.xaxis.autorange === false || plot.layout.xaxis.range[1] === 1;
    }
    // A page of its own makes none.
    found.requests = performance.getEntriesByType("resource").map((entry) => entry.name)
      .filter((name) => !name.startsWith("data:"));
    const script = document.createElement("script");
    script.type = "application/json";
    script.id = "probe";
    script.textContent = JSON.stringify(found).replaceAll("<", "\\u003c");
    document.body.append(script);
  }

  addEventListener("load", () => look().catch((error) => {
    document.title = `probe failed: ${error}`;
    console.error(error);
  }));
})();
