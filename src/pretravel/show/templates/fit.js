// What a picture needs in a place of some pixels: its words in lines that the place has room for, margins for these
// lines, and in space a camera whose picture fills the place.
"use strict";
const fitted = (figure, width, height) => {
  const LETTER = 0.56; // mean width of a letter, in heights
  const LINE = 1.3;
  const BAR = 84; // a bar of colours with its numbers and its title
  const { data, layout } = figure;
  if (!width || !height || !layout.title) return figure;

  // Tags of HTML have no width, and are not broken.
  const words = (text) => text.match(/(?:<[^>]+>|[^\s<])+/g) ?? [];
  const long = (text) => text.replace(/<[^>]+>/g, "").replace(/&\w+;/g, "x").length;
  const inLines = (text, pixels, size) => {
    const most = Math.max(8, Math.floor(pixels / (LETTER * size)));
    return text.split("<br>").map((line) => {
      if (long(line) <= most) return line;
      let made = "", now = 0;
      for (const word of words(line.replace(/<span style='[^']*'>/g, (tag) => tag.replaceAll(" ", "\u0001")))) {
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

  // A frame or a note stands beside the title where there is room.
  const [heading, ...more] = layout.title.text.split("<br>");
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
  const wideOf = (name) => 13 * LETTER * Math.max(...name.split("<br>").map(long)) + 44;
  const names = inLegend.map((trace) => wideOf(trace.name ?? ""));
  const across = Math.max(1, Math.floor((0.95 * width) / Math.max(...names, 1)));
  const oneRow = names.reduce((sum, each) => sum + each, 0) <= 0.95 * width;
  const rows = !names.length || layout.showlegend === false ? 0 : oneRow ? 1 : Math.ceil(names.length / across);
  const bars = data.map((trace) => trace.marker?.colorbar ?? trace.colorbar).filter(Boolean);
  const right = bars.length ? BAR : layout.scene ? 4 : 24;
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
  else if (layout.polar) margin = { l: width < 420 ? 34 : 48, r: bars.length ? BAR + (width < 420 ? 26 : 40) : width < 420 ? 34 : 48, t: top + 18, b: 30 + legend };
  else {
    const { xaxis, yaxis } = layout;
    const wide = width - 80 - right;
    const more = xaxis?.ticktext ? 12 * LINE * (linesBelow(xaxis, wide) - 1) : 0;
    const below = xaxis?.visible === false ? 0 : 26 + more + 13 * LINE * withTitle(xaxis, wide);
    margin = { ...margin, r: right, b: below + 12 + legend + (layout.sliders ? 60 : 0) };
    if (yaxis?.ticktext) named(yaxis, height - margin.t - margin.b);
    if (yaxis?.visible !== false) withTitle(yaxis, height - margin.t - margin.b - 16);
    margin.r = Math.max(right, besideBars(xaxis, yaxis));
  }
  layout.margin = margin;
  for (const bar of bars) Object.assign(bar, { xref: "container", x: 1, xanchor: "right", xpad: 4 });
  for (const bar of bars) withTitle(bar, height - margin.t - margin.b - 24, 13);
  const camera = layout.scene?.camera;
  if (camera) layout.scene.camera = seen(layout.scene, camera, width - margin.l - right - beside, height - margin.t - margin.b);
  return { ...figure, layout };

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

  // The nearest place on the line of sight from which all corners of the box, with the words beside its axes, are in
  // the picture; Plotly's angle of view is 45° over the height.
  function seen(scene, camera, w, h) {
    const bare = scene.xaxis?.visible === false;
    const [aside, above] = bare ? [beside ? 36 : 10, 10] : [Math.min(68, 0.27 * w), Math.min(24, 0.08 * h)];
    const size = Math.hypot(...["x", "y", "z"].map((axis) => camera.eye[axis]));
    const [x, y, z] = ["x", "y", "z"].map((axis) => camera.eye[axis] / size);
    const flat = Math.hypot(x, y) || 1e-9;
    const rightwards = [-y / flat, x / flat, 0];
    const upwards = [(-x * z) / flat, (-y * z) / flat, flat];
    const focus = h / 2 / Math.tan(Math.PI / 8);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const side = scene.aspectratio;
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
      const place = ["x", "y", "z"].map((axis, bit) => (corner & (1 << bit) ? 0.5 : -0.5) * side[axis]);
      return [rightwards, upwards, [x, y, z]].map((direction) => dot(place, direction));
    });
    // What is near looks larger: the camera looks at the middle of what is seen, not of the box.
    let far = 0.1, up = 0;
    for (let turn = 0; turn < 6; turn += 1) {
      far = 0.1;
      for (const [a, b, near] of corners)
        far = Math.max(far, near + (Math.abs(a) * focus) / (w / 2 - aside), near + (Math.abs(b - up) * focus) / (h / 2 - above));
      const heights = corners.map(([, b, near]) => (b - up) / (far - near));
      up += 0.5 * far * (Math.max(...heights) + Math.min(...heights));
    }
    // The words stand below the box: it is seen a little higher.
    const raised = up - (bare ? 0 : (0.7 * above * far) / focus);
    const [cx, cy, cz] = upwards.map((part) => raised * part);
    return { ...camera, eye: { x: far * x + cx, y: far * y + cy, z: far * z + cz }, center: { x: cx, y: cy, z: cz } };
  }
};
