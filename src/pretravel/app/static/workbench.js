// Uploads, copying, sorting of tables made by hand, and the choice of the theme. Events are handled on the
// document: the elements come and go.
"use strict";

(() => {
  const statusOf = (input) => input.closest(".file-drop").querySelector(".file-drop-status");

  async function send(input, files) {
    const status = statusOf(input);
    const problems = [];
    const chosen = input.multiple ? [...files] : [...files].slice(0, 1);
    if (chosen.length < files.length) problems.push("Only one file is taken here: the first one.");
    for (const [index, file] of chosen.entries()) {
      status.className = "file-drop-status";
      status.textContent = `Sending ${file.name} (${index + 1} of ${chosen.length}) …`;
      try {
        const address = `${input.dataset.url}?name=${encodeURIComponent(file.name)}`;
        const headers = { "X-Pretravel": "upload", "Content-Type": "application/octet-stream" };
        const answer = await fetch(address, { method: "POST", body: file, headers });
        const said = await answer.json().catch(() => ({}));
        if (!answer.ok) problems.push(said.error || `${file.name} was not taken (${answer.status})`);
      } catch {
        problems.push(`${file.name} could not be sent: is the workbench still running?`);
      }
    }
    status.textContent = problems.join(" ");
    status.classList.toggle("problem", problems.length > 0);
    input.value = "";
  }

  document.addEventListener("change", (event) => {
    const target = event.target;
    if (target.matches?.("input.file-drop-input") && target.files.length) send(target, target.files);
    if (target.id === "theme") {
      document.cookie = `pretravel_theme=${target.value};path=/;max-age=31536000;samesite=strict`;
      const dark = { auto: "auto", dark: true, light: false }[target.value];
      Quasar.Dark.set(dark);
    }
  });

  // A label is no target of the keyboard; its file input is, and Enter opens it as Space does.
  document.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target.matches?.("input.file-drop-input")) event.target.click();
  });

  for (const kind of ["dragover", "dragenter"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      event.target.closest?.(".file-drop")?.classList.add("over");
    });
  }
  document.addEventListener("dragleave", (event) => {
    event.target.closest?.(".file-drop")?.classList.remove("over");
  });
  // Beside a drop place the browser would leave the page and show the file.
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    const place = event.target.closest?.(".file-drop");
    const drops = document.querySelectorAll("input.file-drop-input");
    document.querySelectorAll(".file-drop.over").forEach((e) => e.classList.remove("over"));
    const input = place?.querySelector("input.file-drop-input") ?? (drops.length === 1 ? drops[0] : null);
    if (input && event.dataTransfer.files.length) send(input, event.dataTransfer.files);
  });

  document.addEventListener("click", (event) => {
    const copy = event.target.closest?.("[data-copy]");
    if (copy) copyText(copy);
    const heading = event.target.closest?.("table.sortable th");
    if (heading && !heading.closest(".data-table")) sort(heading);
  });

  async function copyText(button) {
    const content = button.dataset.copy;
    try {
      await navigator.clipboard.writeText(content);
    } catch {
      // Without https, from another computer: the old way.
      const area = Object.assign(document.createElement("textarea"), { value: content });
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    Quasar.Notify.create({ message: "Copied", timeout: 1200 });
  }

  function sort(heading) {
    const table = heading.closest("table");
    const column = [...heading.parentNode.children].indexOf(heading);
    const down = heading.getAttribute("aria-sort") === "ascending";
    for (const other of heading.parentNode.children) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const value = (row) => row.children[column].textContent.trim();
    const body = table.tBodies[0];
    const rows = [...body.rows].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      const both = x !== "" && y !== "" && !isNaN(x) && !isNaN(y);
      return (both ? x - y : x.localeCompare(y)) * (down ? -1 : 1);
    });
    body.append(...rows);
  }
})();
