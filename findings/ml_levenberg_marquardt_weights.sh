#!/bin/sh
# ml-levenberg-marquardt 5.1.0 (npm): with `weights` other than 1 the fit stays at its start, without an error. They are standard deviations (1/w² in
# the code, the README does not say it), and each step multiplies its matrix by 1/w² but divides the distances by it: w = 0.002 mm makes steps
# that are 6e10 times too short, w = 2 µm some that are 16 times too long and are taken back. Twelve touches in a ring of 20 mm, start 0.7 mm off.
# Expected: the same circle with one w for all points.
. "$(dirname "$0")/setup.sh"
modules ml-levenberg-marquardt@5.1.0
cat >"$folder/fit.mjs" <<'END'
import assert from "node:assert";
import { levenbergMarquardt } from "ml-levenberg-marquardt";

const touches = [...Array(12).keys()].map((k) => [
  100 + 10 * Math.cos((k * Math.PI) / 6), 50 + 10 * Math.sin((k * Math.PI) / 6)]);
const data = { x: touches.map((_, k) => k), y: touches.map(() => 0) };
const distance = (unit) => ([x, y, radius]) => (k) =>
  (Math.hypot(touches[k][0] - x, touches[k][1] - y) - radius) / unit;
const start = { initialValues: [100.3, 49.6, 9.5], maxIterations: 1000, errorTolerance: 1e-20 };
const far = (options, unit = 1) => {
  const [x, y, radius] = levenbergMarquardt(data, distance(unit), { ...start, ...options }).parameterValues;
  return Math.hypot(x - 100, y - 50, radius - 10);
};
const seen = {
  none: far({}), "0.002": far({ weights: 0.002 }), each: far({ weights: Array(12).fill(0.002) }),
  2: far({ weights: 2 }), "in the model": far({}, 0.002),
};
console.log("mm from the circle:", seen);
const off = Math.hypot(0.3, 0.4, 0.5);
assert(seen.none < 1e-4 && seen["in the model"] < 1e-4);
assert(Math.abs(seen["0.002"] - off) < 1e-3 && Math.abs(seen.each - off) < 1e-3 && seen[2] > 0.1);
END
(cd "$folder" && node fit.mjs)
