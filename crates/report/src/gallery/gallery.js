// Chooses the metric of the matrix, and the runs of the table. Without it the matrix has the first metric, and the table
// all runs.
(() => {
  "use strict";

  const text = document.getElementById("matrix-data")?.textContent;
  const select = document.getElementById("metric");
  if (text && select) {
    const { meanings, runs } = JSON.parse(text);
    const cells = [...document.querySelectorAll(".matrix td[data-run]")];

    const show = (metric) => {
      document.getElementById("meaning").textContent = meanings[metric];
      for (const cell of cells) {
        const [value, level, found] = runs[cell.dataset.run][metric];
        const mark = cell.querySelector(".mark");
        const [sign, words] = found ?? ["", ""];
        mark.textContent = sign;
        mark.title = words;
        mark.classList.toggle("high", sign === "\u25b2");
        mark.classList.toggle("low", sign === "\u25bc");
        cell.querySelector("a, .value").textContent = value === "" ? "-" : value;
        if (level === null) cell.style.removeProperty("--level");
        else cell.style.setProperty("--level", level);
      }
    };
    select.addEventListener("change", () => show(Number(select.value)));
    select.disabled = false;
    // A browser keeps the choice when the reader comes back from a replay.
    show(Number(select.value));
  }

  const choice = document.querySelector("fieldset.choice");
  const filter = () => {
    const shown = choice.querySelector("input:checked").value;
    for (const row of document.querySelectorAll(".all tbody tr")) row.hidden = shown !== "all" && !(shown in row.dataset);
  };
  if (choice) {
    choice.disabled = false;
    choice.addEventListener("change", filter);
    filter();
  }
})();
