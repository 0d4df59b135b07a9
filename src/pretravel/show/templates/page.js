"use strict";
(() => {
  const content = JSON.parse(document.getElementById("content").textContent);
  const root = document.documentElement;
  document.querySelector(".tools").hidden = false;
  document.getElementById("print").addEventListener("click", () => window.print());

  // The certificate alone, laid out for paper: it is in the page, and shown while it is printed.
  const certificate = document.getElementById("certificate");
  document.getElementById("print-certificate")?.addEventListener("click", async () => {
    const sheet = document.createElement("div");
    const rule = document.createElement("style");
    rule.textContent = certificate.dataset.page;
    sheet.id = "sheet";
    sheet.append(rule, certificate.content.cloneNode(true));
    const images = [...sheet.querySelectorAll("img")];
    for (const image of images) image.src = document.getElementById(image.dataset.of).src;
    await Promise.allSettled(images.map((image) => image.decode()));
    document.body.append(sheet);
    root.classList.add("certificate-only");
    const printed = () => {
      root.classList.remove("certificate-only");
      sheet.remove();
    };
    window.addEventListener("afterprint", printed, { once: true });
    window.print();
  });

  // Light and dark: that of the system until the reader chooses.
  const system = window.matchMedia("(prefers-color-scheme: dark)");
  const dark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  const changed = () => {
    document.getElementById("theme").textContent = dark() ? "Light" : "Dark";
    recolour();
  };
  document.getElementById("theme").addEventListener("click", () => {
    root.dataset.theme = dark() ? "light" : "dark";
    changed();
  });
  system.addEventListener("change", changed);

  // Tables: sorted by a click or a key on a heading. Cells without a value are always last.
  const number = (text) => {
    const plain = text.trim().replace("−", "-").replace("∞", "Infinity");
    return plain === "" ? NaN : Number(plain);
  };
  const compare = (a, b) => {
    const left = number(a);
    const right = number(b);
    if (Number.isNaN(left) || Number.isNaN(right)) {
      if (!Number.isNaN(left)) return -1;
      if (!Number.isNaN(right)) return 1;
      return a.localeCompare(b, "en", { numeric: true });
    }
    return left === right ? 0 : left - right;
  };
  const sortBy = (table, column) => {
    const heading = table.tHead.rows[0].cells[column];
    const down = heading.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) other.setAttribute("aria-sort", "none");
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const text = (row) => row.cells[column].textContent;
    const rows = [...table.tBodies[0].rows];
    const empty = rows.filter((row) => text(row).trim() === "");
    const full = rows.filter((row) => text(row).trim() !== "");
    full.sort((a, b) => (down ? -1 : 1) * compare(text(a), text(b)));
    table.tBodies[0].append(...full, ...empty);
  };
  for (const table of document.querySelectorAll(".wide > table.data")) {
    if (table.tBodies[0].rows.length < 2) continue;
    [...table.tHead.rows[0].cells].forEach((heading, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...heading.childNodes);
      button.addEventListener("click", () => sortBy(table, column));
      heading.append(button);
      heading.setAttribute("aria-sort", "none");
    });
  }

  // Tables as CSV: all digits of the values, and no text that a spreadsheet would execute.
  const formula = /^'*[=+\-@\t\r\n＝＋－＠]/;
  const harmless = (text) => {
    const isNumber = text !== "" && text.trim() === text && Number.isFinite(Number(text));
    return formula.test(text) && !isNumber ? "'" + text : text;
  };
  const cell = (value) => {
    let text = value;
    if (value === null) text = "";
    else if (typeof value === "object") text = value.infinite > 0 ? "inf" : "-inf";
    else if (typeof value === "number") text = String(value);
    else text = harmless(value);
    return /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  };
  const asCsv = (table) => {
    const heading = (column) => (column.unit ? column.name + "/" + column.unit : column.name);
    const rows = [table.columns.map((column) => cell(heading(column)))];
    table.columns[0].values.forEach((_, row) => {
      rows.push(table.columns.map((column) => cell(column.values[row])));
    });
    return "\ufeff" + rows.map((row) => row.join(",") + "\r\n").join("");
  };
  for (const button of document.querySelectorAll(".download")) {
    const table = button.dataset.place.split(".").reduce((part, key) => part[key], content.reports);
    const name = (table.title || document.title).replace(/[^\p{L}\p{N}]+/gu, "-");
    button.hidden = false;
    button.setAttribute("aria-label", "Download CSV: " + (table.title || document.title));
    button.addEventListener("click", () => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([asCsv(table)], { type: "text/csv" }));
      link.download = name.replace(/^-|-$/g, "").slice(0, 60) + ".csv";
      link.click();
      URL.revokeObjectURL(link.href);
    });
  }

  // Paper has all details.
  let closed = [];
  window.addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    closed.forEach((part) => (part.open = true));
  });
  window.addEventListener("afterprint", () => closed.forEach((part) => (part.open = false)));

  // Pictures to turn, to zoom, to read off: drawn when they come into view.
  const given = document.getElementById("charts");
  let charts = { figures: {}, light: {}, dark: {} };
  const drawn = [];
  const most = 6; // pictures in space at a time: browsers allow few
  let plotly = null;
  const unpacked = (element) => {
    const packed = atob(element.textContent.trim());
    const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  };
  const load = async () => {
    const script = document.createElement("script");
    script.textContent = await unpacked(document.getElementById("plotly"));
    document.head.append(script);
    return window.Plotly;
  };
  const coloured = (value) => {
    if (typeof value === "string") return charts[dark() ? "dark" : "light"][value] ?? value;
    // Numbers alone have no colours; a step of a scale is a number with a colour.
    if (Array.isArray(value)) return value.length !== 2 && typeof value[0] === "number" ? value : value.map(coloured);
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, coloured(part)]));
  };
  const settings = { displaylogo: false, responsive: false, scrollZoom: false };
  const fill = (picture) => {
    picture.plots.forEach((place, index) => {
      fitted.drawn(place, window.Plotly, coloured(picture.figures[index]), settings);
    });
  };
  let resized = 0;
  window.addEventListener("resize", () => {
    clearTimeout(resized);
    resized = setTimeout(() => window.Plotly && drawn.forEach(fill), 200);
  });
  const release = (picture) => {
    picture.plots.forEach((place) => window.Plotly.purge(place));
    picture.box.remove();
    picture.element.classList.remove("turned");
    drawn.splice(drawn.indexOf(picture), 1);
  };
  const show = async (element) => {
    const image = element.querySelector("img");
    if (drawn.some((picture) => picture.element === element)) return;
    const box = document.createElement("div");
    box.className = "plots";
    const figures = charts.figures[image.id];
    const plots = figures.map(() => box.appendChild(document.createElement("div")));
    const picture = { element, box, figures, plots };
    drawn.push(picture);
    plotly = plotly ?? load();
    await plotly;
    image.after(box);
    element.classList.add("turned");
    fill(picture);
    for (const place of plots) fitted.turnable(place, window.Plotly);
    const inSpace = drawn.filter((other) => other.figures.some((one) => one.layout.scene));
    if (inSpace.length > most) release(inSpace[0]);
  };
  const recolour = () => drawn.filter((picture) => picture.box.isConnected).forEach(fill);
  const begin = async () => {
    charts = JSON.parse(await unpacked(given));
    const watch = new IntersectionObserver(
      (entries) => entries.filter((one) => one.isIntersecting).forEach((one) => show(one.target)),
      { rootMargin: "200px" },
    );
    for (const picture of document.querySelectorAll(".picture")) {
      if (charts.figures[picture.querySelector("img").id]) watch.observe(picture);
    }
  };
  if (given && "DecompressionStream" in window && "IntersectionObserver" in window) begin();
  changed();
})();
