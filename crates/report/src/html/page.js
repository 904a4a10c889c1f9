// Sorts tables by a click on a head, and gives wide ones the columns that have room; the others are shown
// on demand. Without it tables keep their own order, and scroll.
(() => {
  "use strict";

  // The number that a cell begins with, `1 234.5 [1 200, 1 300]`, `< 0.0001` or `-`; NaN where there is none.
  function leading(cell) {
    const found = cell.trim().replaceAll("\u2212", "-").replaceAll("\u2060", "").match(/^(?:< ?)?([-+]?\d+( \d{3})*(\.\d+)?(e[-+]?\d+)?)/i);
    return found ? Number(found[1].replaceAll(" ", "")) : NaN;
  }

  const words = new Intl.Collator("en", { numeric: true });

  function compare(a, b) {
    const [x, y] = [leading(a), leading(b)];
    if (!Number.isNaN(x) && !Number.isNaN(y)) return x - y || words.compare(a, b);
    if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
    return words.compare(a, b);
  }

  // Marks the rows that begin as the one above them does, as those of several variants of a metric.
  function markAgain(body) {
    let above = null;
    for (const row of body.rows) {
      const name = row.cells[0].textContent;
      row.classList.toggle("again", name !== "" && name === above);
      above = name;
    }
  }

  function sortable(table) {
    const body = table.tBodies[0];
    markAgain(body);
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
        markAgain(body);
      });
    });
  }

  // ---- Room for columns ----

  // Fewer columns than these say too little; such rows become cards.
  const FEWEST = 3;
  // As wide as a phone, in pixels: there every row that lacks columns is a card, as the last columns, which
  // wait elsewhere behind a button, are often those that matter (differences, p). Longer tables stay tables.
  const PHONE = 480;
  const MOST_CARDS = 60;
  const rules = document.createElement("style");
  document.head.append(rules);
  let known = 0;

  // Hides all columns but the first: one change of style, however many rows there are.
  function show(table, count, all) {
    for (; known < all; known += 1) {
      rules.sheet.insertRule(`table[data-shown="${known}"] tr > :nth-child(n + ${known + 1}) { display: none; }`);
    }
    if (count < all) table.dataset.shown = count;
    else delete table.dataset.shown;
  }

  function fitted(place) {
    const [table, room] = [place.querySelector("table"), place.querySelector(".scrolled")];
    const heads = [...table.tHead.rows[0].cells].map((head) => head.textContent);
    for (const row of table.tBodies[0].rows) {
      [...row.cells].forEach((cell, k) => cell.setAttribute("data-head", heads[k]));
    }
    const more = document.createElement("button");
    more.type = "button";
    more.className = "more";
    more.hidden = true;
    place.append(more);
    let isOpen = false;
    const fits = () => table.offsetWidth <= room.clientWidth && room.scrollWidth <= room.clientWidth;
    const fit = () => {
      if (room.clientWidth === 0) return;
      table.classList.remove("cards");
      let count = heads.length;
      show(table, count, heads.length);
      while (count > FEWEST && !fits()) show(table, (count -= 1), heads.length);
      const left = heads.length - count;
      const isShort = table.tBodies[0].rows.length <= MOST_CARDS;
      const isOfCards = table.matches(".claims") || (room.clientWidth < PHONE && isShort);
      const isNarrow = !fits() || (left > 0 && isOfCards);
      if (isNarrow || (isOpen && left > 0)) {
        show(table, heads.length, heads.length);
        table.classList.add("cards");
      }
      more.hidden = left === 0 || isNarrow;
      more.textContent = isOpen ? "Fewer columns" : `${left} more column${left > 1 ? "s" : ""}: ${heads.slice(count).join(", ")}`;
      more.setAttribute("aria-expanded", String(isOpen));
    };
    more.addEventListener("click", () => {
      isOpen = !isOpen;
      fit();
    });
    // What is folded has no size until it is opened.
    place.closest("details")?.addEventListener("toggle", fit);
    let before = -1;
    new ResizeObserver(() => {
      if (room.clientWidth !== before) {
        before = room.clientWidth;
        // In a frame of its own: a change of sizes within the observer's would call it again.
        requestAnimationFrame(fit);
      }
    }).observe(room);
    fit();
  }

  // ---- Runs ----

  // In the frame of the studio, whoever asks for a variant gets its run of a seed, or its first: the studio
  // hears of it, and looks for the run itself. A page of its own has no one to ask.
  function withRuns(table) {
    const heads = [...table.tHead.rows[0].cells].map((head) => head.textContent);
    const [named, seeded] = [heads.indexOf("variant"), heads.indexOf("seed")];
    for (const row of named < 0 ? [] : table.tBodies[0].rows) {
      const cell = row.cells[named];
      const [variant, seed] = [cell.textContent, seeded < 0 ? null : row.cells[seeded].textContent];
      const button = document.createElement("button");
      button.type = "button";
      button.className = "open";
      button.title = seed ? `Opens the run of seed ${seed}` : "Opens the first run";
      button.append(...cell.childNodes);
      button.addEventListener("click", () => window.parent.postMessage({ opens: { variant, seed } }, "*"));
      cell.append(button);
    }
  }

  if (window.parent !== window) document.querySelectorAll("table.sortable").forEach(withRuns);

  // A link to something folded opens it.
  function open() {
    const named = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (named?.matches("details")) named.open = true;
  }

  document.querySelectorAll("table.sortable").forEach(sortable);
  document.querySelectorAll(".wide").forEach(fitted);
  window.addEventListener("hashchange", open);
  open();
  // Paper has room for all columns.
  window.addEventListener("beforeprint", () => {
    document.querySelectorAll(".wide table").forEach((table) => {
      table.classList.remove("cards");
      delete table.dataset.shown;
    });
  });
})();
