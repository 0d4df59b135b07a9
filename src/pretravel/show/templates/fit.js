// What a picture needs in a place of some pixels: its words in lines that the place has room for, margins for these
// lines, and in space a camera whose picture fills the place.
"use strict";
const fitted = (figure, width, height, turned) => {
  const LETTER = 0.56; // mean width of a letter, in heights
  const LINE = 1.3;
  const BAR = 84; // a bar of colours with its numbers and its title
  const SLIM = 54; // without a title
  const { data, layout } = figure;
  if (!width || !height || !layout.title) return figure;

  // Tags of HTML have no width, and are not broken.
  const words = (text) => text.match(/(?:<[^>]+>|[^\s<])+/g) ?? [];
  const long = (text) => text.replace(/<[^>]+>/g, "").replace(/&\w+;/g, "x").length;
  const inLines = (text, pixels, size) => {
    return text.split("<br>").map((line) => {
      const most = Math.max(8, Math.floor(pixels / (LETTER * (line.startsWith("<span") ? 12 : size))));
      if (long(line) <= most) return line;
      let made = "", now = 0;
      // A quantity stays with its unit, and with its value.
      const whole = line.replace(/<span style='[^']*'>/g, (tag) => tag.replaceAll(" ", "\u0001")).replace(/ ([/=]) /g, "\u0001$1\u0001");
      for (const word of words(whole)) {
        const count = long(word);
        made += now === 0 ? word : now + 1 + count > most ? `<br>${word}` : ` ${word}`;
        now = now === 0 || now + 1 + count > most ? count : now + 1 + count;
      }
      return made.replaceAll("\u0001", " ");
    }).join("<br>");
  };
  const lines = (text) => (text ? text.split("<br>").length : 0);
  const withTitle = (axis, pixels, size = 13) => {
    const title = typeof axis?.title === "string" ? { text: axis.title } : axis?.title;
    if (!title?.text) return 0;
    axis.title = { ...title, text: inLines(title.text, pixels, size), font: { ...title.font, size } };
    return lines(axis.title.text);
  };

  // Beside a bar with its title a scene in a narrow place would be small: the title stands above.
  const bars = data.map((trace) => trace.marker?.colorbar ?? trace.colorbar).filter(Boolean);
  const narrow = layout.scene && width < 460;
  const slim = narrow && bars.length === 1;
  // A frame or a note stands beside the title where there is room.
  const [heading, ...more] = layout.title.text.split("<br>");
  const notes = slim ? [`colours: ${bars[0].title.text}`] : [];
  if (slim) Object.assign(bars[0], { title: { text: "" }, thickness: 10, tickfont: { size: 11 } });
  if (layout.scene) inSmall(layout.scene);
  if (notes.length) {
    const said = notes.join(", ");
    more.push(`<span style='font-size:12px'>${said[0].toUpperCase()}${said.slice(1)}</span>`);
  }
  const joined = more.reduce((text, line) => {
    const last = text.slice(text.lastIndexOf("<br>") + 1);
    const fits = !line.startsWith("<span") && long(`${last}, ${line}`) * LETTER * 15 < width - 24;
    return text + (fits ? ", " : "<br>") + line;
  }, heading);
  const title = inLines(joined, width - 24, 15);
  layout.title = { ...layout.title, text: title, pad: { t: 22 } };
  const top = title ? 30 + 15 * LINE * lines(title) : 30;

  // A legend of one row, or in columns of the width of its longest name; beside a scene names have two lines.
  const inLegend = data.filter((trace) => trace.showlegend);
  const folded = inLegend.map((trace) => inLines(trace.name ?? "", 150, 13));
  const wideOf = (name) => 13 * 0.62 * Math.max(...name.split("<br>").map(long)) + 46; // words of wide letters, too
  const names = inLegend.map((trace) => wideOf(trace.name ?? ""));
  const right = bars.length ? (slim ? SLIM : BAR) : layout.scene ? 4 : 24;
  const around = { l: width < 420 ? 34 : 48, r: bars.length ? BAR + (width < 420 ? 26 : 40) : width < 420 ? 34 : 48 };
  // Plotly gives it the width of the drawing, without the margins.
  const room = width - (layout.polar ? around.l + around.r : layout.scene ? 4 + right : 64 + right);
  const across = Math.max(1, Math.floor(room / Math.max(...names, 1)));
  const oneRow = names.reduce((sum, each) => sum + each, 0) <= room;
  const rows = !names.length || layout.showlegend === false ? 0 : oneRow ? 1 : Math.ceil(names.length / across);
  // Many names stand beside a scene rather than below it.
  const wanted = Math.max(...folded.map(wideOf), 0);
  const tall = layout.scene?.aspectratio && layout.scene.aspectratio.z > 1.5 * layout.scene.aspectratio.x;
  const there = tall ? width - wanted - 72 > 0.36 * (height - top) : width - wanted > 0.9 * (height - top);
  const beside = layout.scene && rows > 2 && !bars.length && there ? wanted : 0;
  const legend = rows && !beside ? 8 + 20 * rows : 0;
  if (beside) {
    inLegend.forEach((trace, n) => { trace.name = folded[n]; });
    layout.legend = { ...layout.legend, orientation: "v", x: 1, xanchor: "right", y: 0.5, yanchor: "middle", yref: "paper" };
    layout.scene.domain = { x: [0, 1 - beside / width], y: [0, 1] };
  }
  let margin = { ...layout.margin, t: top };
  if (layout.scene) margin = { ...margin, l: 4, r: right, b: Math.max(4, legend) };
  else if (layout.polar) margin = { ...around, t: top + 18, b: 30 + legend };
  else {
    const { xaxis, yaxis } = layout;
    const wide = width - 80 - right;
    // Of each power of ten 1, 2 and 5, where there is room, or else 1 alone: all nine cover each other.
    for (const [name, axis, room] of [["x", xaxis, wide / 48], ["y", yaxis, (height - top - legend - 50) / 20]]) {
      if (axis?.type !== "log" || axis.tickvals) continue;
      const values = data.flatMap((trace) => Array.from(trace[name] ?? [])).filter((value) => value > 0);
      const decades = axis.range ? axis.range[1] - axis.range[0] : Math.log10(Math.max(...values) / Math.min(...values));
      if (3 * decades > room) axis.dtick = Math.ceil(decades / room);
      else if (decades > Math.log10(6)) axis.dtick = "D2";
    }
    // Numbers that would be turned for want of room: every second one is enough.
    while (xaxis?.tickvals?.length > 3 && !xaxis.ticktext && xaxis.tickvals.length * 32 > wide)
      xaxis.tickvals = xaxis.tickvals.filter((_, n) => n % 2 === 0);
    // Numbers are never turned: there are as many as there is room for.
    if (xaxis && !xaxis.tickvals && !xaxis.ticktext && xaxis.type !== "log") {
      const names = yaxis?.ticktext ? Math.min(0.4 * width, Math.max(...yaxis.ticktext.map(long)) * LETTER * 13) : 0;
      Object.assign(xaxis, { tickangle: 0, nticks: Math.max(3, Math.floor((wide - names) / 52)) });
    }
    const more = xaxis?.ticktext ? 12 * LINE * (linesBelow(xaxis, wide) - 1) : 0;
    const below = xaxis?.visible === false ? 0 : 26 + more + 13 * LINE * withTitle(xaxis, wide);
    margin = { ...margin, r: right, b: below + 12 + legend + (layout.sliders ? 64 : 0) };
    if (layout.sliders) layout.sliders = layout.sliders.map((slider) => ({ ...slider, pad: { t: below + 12 } }));
    if (yaxis?.ticktext) named(yaxis, height - margin.t - margin.b);
    if (yaxis?.visible !== false) withTitle(yaxis, height - margin.t - margin.b - 16);
    margin.r = Math.max(right, besideBars(xaxis, yaxis));
    if (yaxis?.scaleanchor) besideBodies(layout, width - 64 - margin.r, height - margin.t - margin.b);
  }
  layout.margin = margin;
  for (const bar of bars) Object.assign(bar, { xref: "container", x: 1, xanchor: "right", xpad: 4 });
  for (const bar of bars) withTitle(bar, height - margin.t - margin.b - 24, 13);
  const camera = layout.scene?.camera;
  let whole;
  if (camera) {
    const place = [width - margin.l - right - beside, height - margin.t - margin.b];
    whole = seen(layout.scene, camera, ...place);
    layout.scene.camera = turned ? fitted.turnedAs(whole, turned) : whole;
    numbered(layout.scene, whole, place[1]);
    layout.scene.annotations = fitted.notes(layout.scene, layout.scene.camera, ...place, data);
  }
  return { ...figure, layout, whole };

  // Numbers of the axes of a scene: as many as their edges have room for as they are seen, and none at the corners, where
  // those of two edges meet.
  function numbered(scene, { eye, center }, high) {
    const axes = ["x", "y", "z"], sight = axes.map((axis) => eye[axis] - center[axis]);
    const far = Math.hypot(...sight);
    axes.forEach((name, n) => {
      const axis = scene[`${name}axis`];
      if (!axis?.range || axis.visible === false) return;
      const [low, top] = axis.range, long = top - low;
      const across = Math.sqrt(Math.max(0, 1 - (sight[n] / far) ** 2)); // the share that is seen from aside
      const pixels = (scene.aspectratio[name] * across * high) / 2 / Math.tan(Math.PI / 8) / far;
      const least = long / Math.max(1, Math.min(6, pixels / 22)), ten = 10 ** Math.floor(Math.log10(least));
      const step = ten * [1, 2, 5, 10].find((each) => each * ten >= least);
      const inner = Math.min(0.25, 8 / pixels) * long;
      const every = Array.from({ length: Math.floor(top / step) - Math.ceil(low / step) + 1 }, (_, k) => (Math.ceil(low / step) + k) * step);
      const apart = every.filter((value) => value > low + inner && value < top - inner);
      const middle = (low + top) / 2;
      axis.tickvals = apart.length ? apart : every.sort((a, b) => Math.abs(a - middle) - Math.abs(b - middle)).slice(0, 1);
      axis.ticktext = axis.tickvals.map((value) => `${+value.toPrecision(10)}`.replace("-", "−"));
    });
  }

  // In a small picture points would cover each other and the body. In a narrow one the unit of the axes stands above.
  function inSmall(scene) {
    const share = Math.min(1, Math.max(0.5, Math.min(width, height) / 560));
    for (const { type, marker } of data) if (type === "scatter3d" && marker?.size) marker.size *= share;
    for (const name of ["xaxis", "yaxis", "zaxis"]) {
      const axis = scene[name];
      if (!axis || axis.visible === false) continue;
      const [letter, unit] = (axis.title?.text ?? "").split(" / ");
      if (!narrow || !unit) continue;
      axis.title = { ...axis.title, text: letter };
      if (name === "xaxis") notes.push(`axes in ${unit}`);
    }
  }

  // The margin that numbers beside bars need: those of the longest bars go beyond the axis.
  function besideBars(xaxis, yaxis) {
    const [low, high] = xaxis?.range ?? [];
    if (!(high > low) || xaxis.type === "log" || !yaxis?.ticktext) return 0;
    const size = yaxis.tickfont?.size ?? 13;
    const names = 20 + Math.max(...yaxis.ticktext.map((text) => Math.max(...text.split("<br>").map(long)))) * LETTER * size;
    const needed = data.filter((trace) => trace.textposition === "middle right").flatMap((trace) =>
      Array.from(trace.x ?? [], (x, n) => {
        const share = (x - low) / (high - low);
        const text = Array.isArray(trace.text) ? trace.text[n] : trace.text;
        return share < 0.3 ? 0 : (12 + 13 * LETTER * long(`${text ?? ""}`) - (1 - share) * (width - names)) / share;
      }));
    return Math.max(0, ...needed);
  }

  // Words beside what is drawn to scale: the scale leaves room for them.
  function besideBodies({ xaxis, yaxis, annotations = [] }, wide, high) {
    const words = annotations.filter((note) => note.xanchor === "left");
    const said = words.map((note) => note.text);
    if (!words.length) return;
    const ends = (name) => {
      const values = [...data.flatMap((trace) => Array.from(trace[name] ?? [])), ...words.map((note) => note[name])].filter(Number.isFinite);
      return [Math.min(...values), Math.max(...values)];
    };
    const [left] = ends("x"), [low, top] = ends("y");
    const longest = (note) => 12 * LETTER * Math.max(...note.text.split("<br>").map(long));
    const whole = (0.9 * high) / (top - low);
    let scale = 0;
    for (const share of [1, 0.6, 0.46]) { // in lines, where they would make the picture small
      words.forEach((note, n) => { note.text = inLines(said[n], share * wide, 12); });
      scale = Math.min(whole, ...words.map((note) => (0.94 * wide - longest(note)) / (note.x - left)));
      if (scale > 0.8 * whole) break;
    }
    if (!(scale > 0)) return;
    for (const note of words) Object.assign(note, { font: { ...note.font, size: 12 }, align: "left" });
    const right = Math.max(ends("x")[1], ...words.map((note) => note.x + longest(note) / scale));
    xaxis.range = [(left + right - wide / scale) / 2, (left + right + wide / scale) / 2];
    yaxis.range = [(low + top - high / scale) / 2, (low + top + high / scale) / 2];
  }

  // Names below an axis: in lines of the width of their places; the most lines of one.
  function linesBelow(axis, wide) {
    const place = wide / axis.ticktext.length - 6;
    axis.ticktext = axis.ticktext.map((text) => inLines(text, place, 12));
    axis.tickfont = { ...axis.tickfont, size: 12 };
    return Math.max(1, ...axis.ticktext.map(lines));
  }

  // Names beside an axis: in as many lines as their places have room for, else wider, and smaller.
  function named(axis, high) {
    const most = high / axis.ticktext.length;
    for (const [share, size] of [[0.3, 13], [0.4, 13], [0.4, 11], [0.5, 11], [0.6, 10]]) {
      const words = axis.ticktext.map((text) => inLines(text, Math.max(share * width, 96), size));
      axis.tickfont = { ...axis.tickfont, size };
      if (share === 0.6 || Math.max(...words.map(lines)) * size * LINE <= most) {
        axis.ticktext = words;
        return;
      }
    }
  }

  // What has to be in the picture, in the units of the camera: the corners of the box with its axes, or the bodies alone.
  function toSee(scene, bare) {
    const side = scene.aspectratio;
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) =>
      ["x", "y", "z"].map((axis, bit) => (corner & (1 << bit) ? 0.5 : -0.5) * side[axis]));
    if (!bare) return corners;
    const notes = (scene.annotations ?? []).map(fitted.inScene(scene));
    const bodies = data.flatMap(({ x, y, z }) => {
      const step = Math.ceil((x?.length ?? 0) / 1000);
      return Array.from(x ?? [], (_, n) => n).filter((n) => n % step === 0 && x[n] !== null)
        .map((n) => ({ x: x[n], y: y[n], z: z[n] }));
    }).map(fitted.inScene(scene)).concat(notes);
    return bodies.length ? bodies : corners;
  }

  // The nearest place on the line of sight from which all of it, with the words beside its axes, is in the picture;
  // Plotly's angle of view is 45° over the height.
  function seen(scene, camera, w, h) {
    const bare = scene.xaxis?.visible === false;
    const [aside, above] = bare ? [beside ? 36 : 24, 18] : [Math.min(86, (narrow ? 0.2 : 0.25) * w), Math.min(34, 0.14 * h)];
    const size = Math.hypot(...["x", "y", "z"].map((axis) => camera.eye[axis]));
    const [x, y, z] = ["x", "y", "z"].map((axis) => camera.eye[axis] / size);
    const flat = Math.hypot(x, y) || 1e-9;
    const rightwards = [-y / flat, x / flat, 0];
    const upwards = [(-x * z) / flat, (-y * z) / flat, flat];
    const focus = h / 2 / Math.tan(Math.PI / 8);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const places = toSee(scene, bare).map((place) => [rightwards, upwards, [x, y, z]].map((direction) => dot(place, direction)));
    // What is near looks larger: the camera looks at the middle of what is seen, not of the box.
    let far = 0.1, up = 0, over = 0;
    for (let turn = 0; turn < 6; turn += 1) {
      far = 0.1;
      for (const [a, b, near] of places)
        far = Math.max(far, near + (Math.abs(a - over) * focus) / (w / 2 - aside), near + (Math.abs(b - up) * focus) / (h / 2 - above));
      const middle = (seen) => 0.5 * far * (Math.max(...seen) + Math.min(...seen));
      up += middle(places.map(([, b, near]) => (b - up) / (far - near)));
      over += middle(places.map(([a, , near]) => (a - over) / (far - near)));
    }
    // The words stand below the box: it is seen a little higher.
    const raised = up - (bare ? 0 : (0.7 * above * far) / focus);
    const [cx, cy, cz] = upwards.map((part, n) => raised * part + over * rightwards[n]);
    return { ...camera, eye: { x: far * x + cx, y: far * y + cy, z: far * z + cz }, center: { x: cx, y: cy, z: cz } };
  }
};

// A place in the units of the camera.
fitted.inScene = (scene) => (place) => ["x", "y", "z"].map((axis) => {
  const [low, high] = scene[`${axis}axis`].range;
  return ((place[axis] - (low + high) / 2) / (high - low)) * scene.aspectratio[axis];
});

// Whether the way from a place crosses a triangle (Möller and Trumbore 1997).
fitted.crosses = (from, way, [a, b, c]) => {
  const less = (p, q) => p.map((part, n) => part - q[n]);
  const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
  const [one, other, to] = [less(b, a), less(c, a), less(from, a)];
  const side = cross(way, other), turned = cross(to, one), size = dot(one, side);
  const u = dot(to, side) / size, v = dot(way, turned) / size, along = dot(other, turned) / size;
  return u >= 0 && v >= 0 && u + v <= 1 && along > 0 && along < 1; // false without a size
};

// Words at places of a scene: next to each other where their places are close, the uppermost first, each as near to its
// place as there is room in the picture. What lies behind a body has none.
fitted.notes = (scene, camera, width, height, data) => {
  const { eye, center } = camera;
  const sight = ["x", "y", "z"].map((axis) => eye[axis] - center[axis]);
  const bodies = scene.annotations?.length ? data.filter((trace) => trace.type === "mesh3d" && !(trace.opacity < 1)) : [];
  const triangles = bodies.flatMap(({ x, y, z, i, j, k }) => {
    const corners = Array.from(x, (_, n) => fitted.inScene(scene)({ x: x[n], y: y[n], z: z[n] }));
    return Array.from(i, (_, n) => [corners[i[n]], corners[j[n]], corners[k[n]]]);
  });
  const far = Math.hypot(...sight);
  const [x, y, z] = sight.map((part) => part / far);
  const flat = Math.hypot(x, y) || 1e-9;
  const focus = height / 2 / Math.tan(Math.PI / 8);
  const notes = (scene.annotations ?? []).map((note) => {
    const [a, b, c] = fitted.inScene(scene)(note).map((part, n) => part - center["xyz"[n]]);
    const near = focus / (far - (a * x + b * y + c * z));
    const across = width / 2 + ((b * x - a * y) / flat) * near;
    const down = height / 2 - ((c * flat * flat - (a * x + b * y) * z) / flat) * near;
    const place = fitted.inScene(scene)(note);
    const toEye = ["x", "y", "z"].map((axis, n) => eye[axis] - place[n]);
    const visible = !triangles.some((triangle) => fitted.crosses(place, toEye, triangle));
    return { note: { ...note, visible }, across, down, half: [4 * note.text.length + 4, 10] };
  });
  const turns = [90, 45, 135, 0, 180, 315, 225, 270].map((degrees) => (degrees * Math.PI) / 180);
  const shifts = [18, 28, 40, 54, 70, 90].flatMap((reach) => turns.map((turn) => [reach * Math.cos(turn), -reach * Math.sin(turn)]));
  const taken = [];
  for (const one of notes.filter(({ note }) => note.visible).sort((a, b) => a.down - b.down)) {
    const free = shifts.find(([ax, ay]) => {
      const [u, v] = [one.across + ax, one.down + ay];
      const inside = u > one.half[0] && u < width - one.half[0] && v > one.half[1] && v < height - one.half[1];
      return inside && taken.every(([s, t, half]) => Math.abs(u - s) > one.half[0] + half[0] || Math.abs(v - t) > one.half[1] + half[1]);
    });
    const [ax, ay] = free ?? shifts[0];
    Object.assign(one.note, { ax, ay });
    taken.push([one.across + ax, one.down + ay, one.half]);
  }
  return notes.map(({ note }) => note);
};

// Draws a figure in its place. What the reader has turned stays turned: Plotly keeps it in the layout of the first
// drawing, which it does not look at again.
fitted.drawn = (place, plotly, figure, config) => {
  const { data, layout, whole } = fitted(figure, place.clientWidth, place.clientHeight, place.turned);
  place.whole = whole;
  return plotly.react(place, data, layout, config);
};

// The camera as the reader has turned it, as near as the one that shows the whole scene in a place of another size.
fitted.turnedAs = (whole, { camera, whole: before }) => {
  const far = ({ eye, center }) => Math.hypot(...["x", "y", "z"].map((axis) => eye[axis] - center[axis]));
  const scale = before ? far(whole) / far(before) : 1;
  const eye = Object.fromEntries(["x", "y", "z"].map((axis) =>
    [axis, camera.center[axis] + scale * (camera.eye[axis] - camera.center[axis])]));
  return { ...camera, eye };
};

// While a scene turns, its words would pass over each other: they are gone until it rests, and then stand apart.
fitted.turnable = (place, plotly) => {
  let turning = null;
  const rest = () => {
    const { camera, domain: { x } } = place._fullLayout.scene;
    turning = null;
    place.classList.remove("turning");
    place.turned = structuredClone({ camera, whole: place.whole });
    const { scene } = place.layout;
    scene.camera = place.turned.camera;
    if (!scene.annotations?.length) return;
    const { _size } = place._fullLayout;
    const notes = fitted.notes(scene, scene.camera, _size.w * (x[1] - x[0]), _size.h, place.data);
    plotly.relayout(place, { "scene.annotations": notes });
  };
  // Released beside the picture there is no plotly_relayout.
  const released = () => setTimeout(() => turning && plotly.relayout(place, { "scene.camera": turning }), 50);
  place.on("plotly_relayouting", (event) => {
    if (!event?.["scene.camera"]) return;
    if (!turning) for (const end of ["mouseup", "touchend"]) window.addEventListener(end, released, { once: true });
    turning = event["scene.camera"];
    place.classList.add("turning");
  });
  place.on("plotly_relayout", (event) => {
    if (Object.keys(event ?? {}).some((key) => key.startsWith("scene.camera"))) rest();
  });
};
