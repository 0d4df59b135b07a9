#!/bin/sh
# rhino3dm 8.35.0 (npm), control points of a rational curve or surface: get gives (w x, w y, w z, w), and set takes them so. Its text for surfaces calls
# what get gives Euclidean, as getPoint, which it is not; that of curves is empty. A circle of 10 mm radius, handed to another library as points and weights,
# runs between 8.28 and 10 mm; with the corner set to (10, 10) and its weight, to 12.43 mm.
# Expected: (10, 10, 0) and √½ for the corner of a circle of 10 mm, as getPoint gives it of a surface.
. "$(dirname "$0")/setup.sh"
modules rhino3dm@8.35.0 nurbs@1.1.1
cat >"$folder/run.mjs" <<'END'
import nurbs from "nurbs";
import rhino3dm from "rhino3dm";

const rhino = await rhino3dm();
const circle = () => new rhino.Circle([0, 0, 0], 10).toNurbsCurve();
const curve = circle();
const points = [], weights = [], knots = [];
for (let i = 0; i < curve.points().count; i++) {
  const [x, y, , w] = curve.points().get(i);
  points.push([x, y]);
  weights.push(w);
}
for (let i = 0; i < curve.knots().count; i++) knots.push(curve.knots().get(i));
const all = [knots[0], ...knots, knots.at(-1)];
const radii = (controls) => {
  const spline = nurbs({ points: controls, weights, knots: [all], degree: 2 });
  const found = [];
  for (let t = 0; t <= 1000; t++) found.push(Math.hypot(...spline.evaluate([], all[0] + ((all.at(-1) - all[0]) * t) / 1000)));
  return [Math.min(...found), Math.max(...found)];
};
const divided = points.map((point, i) => point.map((x) => x / weights[i]));
const changed = circle();
changed.points().set(1, [10, 10, 0, Math.SQRT1_2]);
const surface = new rhino.Sphere([0, 0, 0], 10).toNurbsSurface().points();
const seen = {
  corner: curve.points().get(1),
  asGiven: radii(points),
  divided: radii(divided),
  set: Math.hypot(...changed.pointAt(Math.PI / 4)),
  get: surface.get(1, 1),
  getPoint: surface.getPoint(1, 1),
};
console.log(seen);
const near = (a, b) => [a].flat().every((x, i) => Math.abs(x - [b].flat()[i]) < 1e-9);
const w = Math.SQRT1_2;
// The middle of an arc of 90° with its ends at (10, 0), (0, 10) and its corner at (x, x), of weight √½.
const middle = (x) => ((5 + w * x) / (1 + w)) * Math.SQRT2;
const holds =
  near(seen.corner, [10 * w, 10 * w, 0, w]) && near(seen.asGiven, [middle(10 * w), 10]) && near(seen.divided, [10, 10]) &&
  near(seen.set, middle(10 / w)) && near(seen.get, [5, 5, -5, 0.5]) && near(seen.getPoint, [10, 10, -10]);
process.exit(holds ? 0 : 1);
END
(cd "$folder" && node run.mjs)
