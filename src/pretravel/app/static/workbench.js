// Uploads, copying, sorting of tables made by hand, the choice of the theme, and what is typed while there is
// no connection. Events are handled on the document: the elements come and go.
"use strict";

(() => {
  const statusOf = (input) => input.closest(".file-drop").querySelector(".file-drop-status");

  // One request for all files: the list of their names and sizes, and then their contents.
  function request(address, files, status) {
    const named = [...files];
    const list = new Blob([JSON.stringify(named.map((file) => [file.name, file.size]))]);
    const several = named.length > 1;
    const query = `?name=${encodeURIComponent(named[0].name)}` + (several ? `&head=${list.size}` : "");
    const words = several ? `${named.length} files` : named[0].name;
    return new Promise((done) => {
      const sent = new XMLHttpRequest();
      sent.open("POST", address + query);
      sent.setRequestHeader("X-Pretravel", "upload");
      sent.setRequestHeader("Content-Type", "application/octet-stream");
      sent.upload.onprogress = (event) => {
        const share = event.lengthComputable ? ` ${Math.round((100 * event.loaded) / event.total)} %` : "";
        status.textContent = `Sending ${words} …${share}`;
      };
      const lost = () => done([0, { error: `${words} could not be sent: is the workbench still running?` }]);
      sent.onerror = sent.onabort = lost;
      sent.onload = () => {
        let said = {};
        try {
          said = JSON.parse(sent.responseText);
        } catch {
          said = { error: `${words} was not taken (${sent.status}): ${sent.responseText.slice(0, 200)}` };
        }
        done([sent.status, said]);
      };
      status.className = "file-drop-status";
      status.textContent = `Sending ${words} …`;
      sent.send(several ? new Blob([list, ...named]) : named[0]);
    });
  }

  // A file that belongs to another screen: the way there.
  function offer(status, said, file) {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: said.offer });
    button.className = "offer";
    button.addEventListener("click", async () => {
      const [code, answer] = await request(said.url, [file], status);
      if (code === 200) location.href = answer.address || said.address;
      else status.textContent = answer.error;
    });
    status.append(" ", button);
  }

  async function send(input, files) {
    const status = statusOf(input);
    const problems = [];
    const limit = Number(input.dataset.limit);
    let chosen = input.multiple ? [...files] : [...files].slice(0, 1);
    if (chosen.length < files.length) problems.push("Only one file is accepted here: the first one.");
    for (const file of chosen)
      if (file.size > limit) problems.push(`${file.name} is larger than ${limit / 1e6} MB, the largest size that is accepted here.`);
    chosen = chosen.filter((file) => file.size <= limit);
    let said = {};
    if (chosen.length) {
      [, said] = await request(input.dataset.url, chosen, status);
      if (said.error) problems.push(said.error);
      else if (said.address) location.href = said.address;
    }
    status.textContent = problems.join(" ");
    status.className = `file-drop-status${problems.length ? " problem" : ""}`;
    if (said.offer) {
      const named = chosen.find((file) => said.error.startsWith(file.name));
      offer(status, said, named ?? chosen[0]);
    }
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

  // A control that is replaced or moves while it is pressed: what the press ended, as the typing in a field, can
  // change the page before the mouse is released, and the browser then makes no click of it. Where the pointer has
  // not moved, the control is clicked, or the one that stands for it now. The same for the keyboard's place.
  const CONTROL = "button, a[href], summary, input, textarea, [tabindex]";
  const wordsOf = (control) => control.ariaLabel || control.innerText || control.textContent;
  const nowOf = ({ control, words, tag }) => {
    const stands = (one) => wordsOf(one) === words && one.checkVisibility() && !one.closest("[inert], [disabled]");
    const alike = control.isConnected ? [control] : [...document.querySelectorAll(`main ${tag}`)];
    const found = alike.filter(stands);
    return found.length === 1 ? found[0] : null;
  };
  const remembered = (control) => ({ control, words: wordsOf(control), tag: control.tagName });
  let pressed = null;
  document.addEventListener("pointerdown", (event) => {
    const control = event.isPrimary && event.button === 0 && event.target.closest?.("main button, main a[href]");
    pressed = control ? { ...remembered(control), x: event.clientX, y: event.clientY } : null;
  }, true);
  document.addEventListener("pointerup", (event) => {
    const before = pressed;
    pressed = null;
    if (!before || Math.hypot(event.clientX - before.x, event.clientY - before.y) > 8) return;
    if (before.control.isConnected && before.control.contains(event.target)) return; // the browser makes the click
    nowOf(before)?.click();
  }, true);
  let focused = null;
  document.addEventListener("focusin", (event) => {
    focused = event.target.matches?.(CONTROL) ? remembered(event.target) : null;
  });
  document.addEventListener("keydown", (event) => {
    if (document.activeElement !== document.body || !focused || focused.control.isConnected) return;
    const now = nowOf(focused);
    now?.focus();
    if (now?.matches("button, summary") && ["Enter", " "].includes(event.key)) {
      event.preventDefault();
      now.click();
    }
  }, true);

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
    if (!yes) setTimeout(whyLost, 2000);
  }

  // What to do where the connection does not come back by itself. A workbench that was started again has another
  // token: it refuses this page.
  async function whyLost() {
    if (window.socket.connected || !lost()) return;
    let why = "ended";
    try {
      const { status } = await fetch(location.pathname + location.search, { cache: "no-store" });
      why = { 403: "again", 404: "closed" }[status] ?? "text";
    } catch {
      // Nothing answers.
    }
    if (window.socket.connected) return; // it has come back meanwhile
    lost().textContent = lost().dataset[why];
    setTimeout(whyLost, 3000);
  }

  // What is changed without a connection is not computed yet: what stands there is of before.
  for (const kind of ["input", "change"]) {
    document.addEventListener(kind, (event) => {
      if (event.target.closest?.("main") && window.socket && !window.socket.connected)
        document.body.classList.add("waiting");
    });
  }

  function keep({ target }) {
    if (!isText(target)) return;
    const { [target.ariaLabel]: _, ...others } = kept();
    const own = window.socket?.connected ? {} : { [target.ariaLabel]: target.value };
    if (Object.keys({ ...others, ...own }).length) localStorage.setItem(place(), JSON.stringify({ ...others, ...own }));
    else localStorage.removeItem(place());
  }
  document.addEventListener("input", (event) => {
    if (isText(event.target)) typedAt = performance.now();
    keep(event);
  });
  document.addEventListener("focusout", (event) => window.socket?.connected && keep(event));

  // What is still being typed while the page is left or loaded again is typed once more, too: a field tells the server
  // after a pause. What it has told is not typed again.
  let typedAt = -Infinity;
  function told(name, message) {
    const value = JSON.stringify(document.activeElement?.value);
    if (name === "event" && message?.args?.includes(value)) typedAt = -Infinity;
  }
  for (const leaving of ["beforeunload", "pagehide"]) {
    window.addEventListener(leaving, () => {
      const field = document.activeElement;
      if (isText(field) && performance.now() - typedAt < 1500)
        localStorage.setItem(place(), JSON.stringify({ ...kept(), [field.ariaLabel]: field.value }));
    });
  }

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
    window.socket.onAnyOutgoing(told);
    window.socket.on("disconnect", () => {
      window.did_handshake = false; // what is sent now waits until the server knows this page again
      connected(false);
      whenConnected(() => {
        connected(true);
        setTimeout(() => document.body.classList.remove("waiting"), 1500);
        // Where the server does not know this page any more, it loads again first, and this never runs.
        setTimeout(() => localStorage.removeItem(place()), 5000);
      });
    });
  });
})();
