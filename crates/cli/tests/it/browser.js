// Begins before the page does. What it finds becomes a JSON script at the end of the page.
(() => {
  // No window of this browser is as narrow as a phone. The page is so from the start: the clock of a probe leaves
  // no time for frames, in which a page would notice that its width has changed.
  if (globalThis.probeWidth) document.documentElement.style.width = `${globalThis.probeWidth}px`;
  const found = { errors: [], violations: [], requests: [] };
  addEventListener("error", (event) => found.errors.push(event.message));
  addEventListener("unhandledrejection", (event) => found.errors.push(String(event.reason)));
  addEventListener("securitypolicyviolation", (event) =>
    found.violations.push(`${event.violatedDirective} ${event.blockedURI}`),
  );
  const all = (selector) => [...document.querySelectorAll(selector)];
  const later = (ms) => new Promise((done) => setTimeout(done, ms));

  // What a mouse sends to the element at a place of the window.
  function send(element, [clientX, clientY], ...kinds) {
    const at = {
      bubbles: true,
      cancelable: true,
      clientX,
      clientY,
      button: 0,
      pointerType: "mouse",
    };
    for (const kind of kinds) {
      const Kind = kind.startsWith("pointer") ? PointerEvent : MouseEvent;
      element.dispatchEvent(new Kind(kind, at));
    }
  }

  // The place in the window of the first mark of a figure that the pointer finds.
  function firstMark(plot) {
    const { spots } = JSON.parse(plot.querySelector('script[type="application/json"]').text);
    const svg = plot.querySelector(".chart");
    const box = svg.getBoundingClientRect();
    const scale = box.width / svg.viewBox.baseVal.width;
    return spots.length === 0 ? null : [box.x + spots[0][0] * scale, box.y + spots[0][1] * scale];
  }

  // What a figure says when the mouse is at its first mark.
  function hover(plot) {
    const at = firstMark(plot);
    if (at) send(plot.querySelector(".chart"), at, "pointermove");
    return plot.querySelector(".tip:not([hidden])")?.textContent ?? "";
  }

  // Words of a figure that touch others or are cut off by its edge.
  function spoiled(plot) {
    const edge = plot.querySelector(".chart").getBoundingClientRect();
    const words = [...plot.querySelectorAll(".chart text")].map((text) => [
      text.textContent,
      text.getBoundingClientRect(),
    ]);
    const isCut = ([, box]) =>
      box.left < edge.left - 1 || box.right > edge.right + 1 || box.bottom > edge.bottom + 1;
    const touch = ([, a], [, b]) =>
      Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
      Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 4;
    return words
      .filter((word, k) => isCut(word) || words.slice(k + 1).some((other) => touch(word, other)))
      .map(([word]) => word);
  }

  // Parts of the page that reach beyond its right side, but those inside what scrolls on its own.
  const beyond = (width) =>
    all("header *, main *, footer *")
      .filter((part) => part.getBoundingClientRect().right > width + 1)
      .filter((part) => !part.closest("pre, .scrolled, svg"))
      .map((part) => part.outerHTML.slice(0, 80));

  // Columns of a table whose head and cells do not stand at the same side, or whose words stand at the right.
  function askew(table) {
    const side = (cell, isRight) => {
      const range = document.createRange();
      range.selectNodeContents(cell.querySelector("button") ?? cell);
      const box = range.getBoundingClientRect();
      return isRight ? box.right : box.left;
    };
    const told = table.caption?.textContent ?? table.closest(".scrolled")?.getAttribute("aria-label");
    return [...table.tHead.rows[0].cells].flatMap((head, column) => {
      const cells = [...table.tBodies[0].rows].slice(0, 20).map((row) => row.cells[column]).filter((cell) => cell?.textContent);
      const isRight = getComputedStyle(head).textAlign === "right";
      // A head without words stands nowhere.
      const stands = (cell) => head.textContent === "" || Math.abs(side(cell, isRight) - side(head, isRight)) <= 1;
      const isWrong = head.offsetWidth > 0 && (!cells.every(stands) || (isRight && cells.some((cell) => !/\d|^-$/.test(cell.textContent))));
      return isWrong ? [`${told}: ${head.textContent}`] : [];
    });
  }

  async function look() {
    // Folded ones have no size before they are opened.
    all(".chart-fold").forEach((details) => (details.open = true));
    const plots = all(".plot");
    for (
      let k = 0;
      k < 300 && all(".plot").length !== Number(document.documentElement.dataset.drawn ?? 0);
      k += 1
    ) {
      await later(100);
    }
    found.figures = all("figure.plot").length;
    found.drawn = plots.filter((plot) => plot.querySelector(".chart")?.getBoundingClientRect().height > 50).length;
    found.spoiled = plots.flatMap(spoiled);
    found.silent = plots.filter((plot) => firstMark(plot) && hover(plot) === "").length;
    found.pictures = all(".picture img").map((picture) => picture.naturalWidth);
    found.tables = all("table").length;
    found.captions = all("caption, details.table > summary").map((title) => title.textContent);
    found.width = document.documentElement.getBoundingClientRect().width;
    // Wide tables with all of their columns behind an edge, folded ones too.
    all("details").forEach((details) => (details.open = true));
    await later(300);
    const isCut = (place) => place.scrollWidth > place.clientWidth + 1;
    found.beyond = beyond(found.width);
    found.cut = all(".scrolled").filter(isCut).map((place) => place.getAttribute("aria-label"));
    const isShort = (table) => table.tBodies[0].rows.length <= 60;
    found.hidden = all("table[data-shown]").filter(isShort).map((table) => table.dataset.shown);
    found.offered = all(".more:not([hidden])").length;
    found.cards = all("table.cards").length;
    found.askew = all("table.sortable:not(.cards)").flatMap(askew);
    const more = all(".more:not([hidden])").find((button) => button.closest(".wide").offsetWidth > 0);
    if (more) {
      more.click();
      await later(200);
      const table = more.closest(".wide").querySelector("table");
      const cells = [...table.tBodies[0].rows[0].cells];
      found.shown_by_more = cells.every((cell) => getComputedStyle(cell).display !== "none" || cell.textContent === "");
      found.cut_by_more = all(".scrolled").filter(isCut).length;
      more.click();
      await later(200);
    }
    all("details").forEach((details) => (details.open = false));
    found.heads = all("h1, h2").map((head) => head.textContent);
    found.badges = all("tbody .badge").map((badge) => badge.textContent);
    found.words = document.querySelector("main").innerText;

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
    all(".chart-fold").forEach((details) => (details.open = true));
    found.hover = plots.map(hover);
    // A page of its own makes none.
    found.requests = performance
      .getEntriesByType("resource")
      .map((entry) => entry.name)
      .filter((name) => !name.startsWith("data:"));
    const script = document.createElement("script");
    script.type = "application/json";
    script.id = "probe";
    script.textContent = JSON.stringify(found).replaceAll("<", "\\u003c");
    document.body.append(script);
  }

  addEventListener("load", () =>
    look().catch((error) => {
      document.title = `probe failed: ${error}`;
      console.error(error);
    }),
  );
})();
