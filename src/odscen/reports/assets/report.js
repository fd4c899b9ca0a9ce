"use strict";
(() => {
  const parts = [...document.querySelectorAll("details")];
  const unfold = document.getElementById("unfold");
  const openAll = () => parts.every((part) => part.open);
  const label = () => {
    if (unfold) unfold.textContent = openAll() ? "Fold all parts" : "Open all parts";
  };
  unfold?.addEventListener("click", () => {
    const open = !openAll();
    for (const part of parts) part.open = open;
    label();
  });
  for (const part of parts) part.addEventListener("toggle", label);
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const part = target?.closest("details");
    if (!part) return;
    part.open = true;
    target.scrollIntoView();
  };
  window.addEventListener("hashchange", reveal);
  reveal();
})();
(() => {
  const table = document.getElementById("actors-table");
  if (!table) return;
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  const key = (row, column) => row.cells[column].textContent.trim();
  const compare = (a, b) => {
    if (a === "" || b === "") return (a === "") - (b === "");
    const [x, y] = [Number(a), Number(b)];
    return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b, "en", { numeric: true }) : x - y;
  };
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.textContent = "";
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...body.rows].sort((a, b) => {
        const [x, y] = [key(a, column), key(b, column)];
        const order = compare(x, y);
        return down && x !== "" && y !== "" ? -order : order;
      });
      body.append(...rows);
    });
  });
  const field = document.getElementById("filter");
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s*,\s*|\s{2,}/).filter(Boolean);
    for (const row of body.rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
    }
  });
})();
