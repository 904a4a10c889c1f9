// Sorts tables by a click on a head. Without it they keep their own order.
(() => {
  "use strict";

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
})();
