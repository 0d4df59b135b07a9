// Uploads, copying, sorting of tables made by hand, the choice of the theme, and what is typed while there is
// no connection. Events are handled on the document: the elements come and go.
"use strict";

(() => {
  const statusOf = (input) => input.closest(".file-drop").querySelector(".file-drop-status");

  async function send(input, files) {
    const status = statusOf(input);
    const problems = [];
    const chosen = input.multiple ? [...files] : [...files].slice(0, 1);
    if (chosen.length < files.length) problems.push("Only one file is taken here: the first one.");
    for (const [index, file] of chosen.entries()) {
      if (file.size > input.dataset.limit) {
        const most = Number(input.dataset.limit) / 1e6;
        problems.push(`${file.name} is larger than ${most} MB, the most that is taken here.`);
        continue;
      }
      status.className = "file-drop-status";
      status.textContent = `Sending ${file.name} (${index + 1} of ${chosen.length}) …`;
      try {
        const address = `${input.dataset.url}?name=${encodeURIComponent(file.name)}`;
        const headers = { "X-Pretravel": "upload", "Content-Type": "application/octet-stream" };
        const answer = await fetch(address, { method: "POST", body: file, headers });
        const said = await answer.json().catch(() => ({}));
        if (!answer.ok) problems.push(said.error || `${file.name} was not taken (${answer.status})`);
        else if (said.address) location.href = said.address;
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

  // A number that is being typed is not one yet; the field tells the server after a pause, or when it is left.
  const isNumber = (field) => field.matches?.('input[inputmode="decimal"]');
  const finished = () => document.body.classList.remove("typing");
  let pause = 0;
  document.addEventListener("input", (event) => {
    if (!isNumber(event.target)) return;
    document.body.classList.add("typing");
    clearTimeout(pause);
    pause = setTimeout(finished, 1200);
  });
  document.addEventListener("change", (event) => isNumber(event.target) && finished());
  document.addEventListener("focusout", (event) => isNumber(event.target) && finished());

  // Without a connection: what is typed is kept in the browser, by project, page and label of the field. A short
  // loss ends by itself, and events that wait are sent; after a long one the page loads again, and it is typed
  // once more.
  const lost = () => document.querySelector(".lost");
  const place = () => `pretravel ${lost()?.dataset.project} ${location.pathname}`;
  const kept = () => JSON.parse(localStorage.getItem(place()) || "{}");
  const isText = (field) => field.matches?.("main input:not([type=file]), main textarea") && field.ariaLabel;

  function connected(yes) {
    document.body.classList.toggle("not-connected", !yes);
    if (lost()) lost().textContent = yes ? "" : lost().dataset.text;
  }

  document.addEventListener("input", (event) => {
    if (!isText(event.target)) return;
    const { [event.target.ariaLabel]: _, ...others } = kept();
    const own = window.socket?.connected ? {} : { [event.target.ariaLabel]: event.target.value };
    if (Object.keys({ ...others, ...own }).length) localStorage.setItem(place(), JSON.stringify({ ...others, ...own }));
    else localStorage.removeItem(place());
  });

  function typeAgain() {
    for (const [label, value] of Object.entries(kept())) {
      const field = [...document.querySelectorAll("main input, main textarea")].find((e) => e.ariaLabel === label);
      if (!field || field.value === value) continue;
      field.value = value;
      field.dispatchEvent(new Event("input", { bubbles: true }));
      field.dispatchEvent(new Event("blur"));
    }
    localStorage.removeItem(place());
  }

  function whenConnected(then) {
    if (window.socket?.connected && window.did_handshake) then();
    else setTimeout(() => whenConnected(then), 50);
  }

  whenConnected(() => {
    // The address says which project this tab shows, also after a reload; and no token any more.
    const shown = lost().dataset.project;
    if (new URLSearchParams(location.search).get("project") !== shown)
      history.replaceState(null, "", `${location.pathname}?project=${shown}`);
    typeAgain();
    window.socket.on("disconnect", () => {
      window.did_handshake = false; // what is sent now waits until the server knows this page again
      connected(false);
      whenConnected(() => {
        connected(true);
        // Where the server does not know this page any more, it loads again first, and this never runs.
        setTimeout(() => localStorage.removeItem(place()), 5000);
      });
    });
  });
})();
