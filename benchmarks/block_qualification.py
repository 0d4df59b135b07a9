"""Whether a qualification on a block states what machine and probe really are.

python benchmarks/block_qualification.py --sets 300
python benchmarks/block_qualification.py --sets 60 --screw 3 --moved

A simulator of its own: a nut that drags its table behind by the play of the screw, a work space
that is stretched and sheared, a block whose faces are tilted planes, a probe with lobes of the
orders 1 to 6, a warm-up drift, noise and the step of a scale. It moves the axes along each approach
in small steps until the tip's surface meets the face, and latches the screw's position after the
pretravel. It shares no equation with `qualification.reference_fit`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from pretravel.base.errors import PretravelError
from pretravel.maps.machine_terms import TERMS
from pretravel.qualification.block_plan import BlockPlan, plan_block
from pretravel.qualification.reference_fit import Reference, ReferenceFit, fit_references
from pretravel.touches import Touches

LENGTHS = (25.4, 50.8, 76.2)
TIP_DIAMETER = 6.0
MICROMETRE = 1e-3


@dataclass
class Shop:
    """A machine with a probe and a block, drawn at random."""

    rng: np.random.Generator
    lengths: tuple[float, ...] = LENGTHS
    u_length: float = 0.3 * MICROMETRE
    scale: np.ndarray = field(init=False)
    shear: np.ndarray = field(init=False)
    backlash: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        rng = self.rng
        self.scale = rng.uniform(-200e-6, 200e-6, 3)
        self.shear = rng.uniform(-200e-6, 200e-6, 3)
        self.backlash = rng.uniform(0.0, 20.0 * MICROMETRE, 3)
        self.mean = rng.uniform(5.0, 20.0) * MICROMETRE
        self.orders = np.arange(1, 7)
        sizes = np.array([1.0, 1.5, 4.0, 0.7, 0.5, 0.7]) * MICROMETRE
        self.lobes = sizes[:, None] * rng.normal(size=(6, 2))
        self.warming = rng.normal(0.0, 4.0 * MICROMETRE, 3)
        self.warms_up = rng.uniform(0.6, 2.0)
        self.noise = rng.uniform(0.3, 1.0) * MICROMETRE
        self.step = 0.1 * MICROMETRE
        self.true_lengths = np.array(self.lengths) + rng.normal(0.0, self.u_length, 3)
        self.unsquare = rng.normal(0.0, 100e-6, 3)
        self.wedges = rng.normal(0.0, 1.0, (3, 2)) * MICROMETRE / np.array(self.lengths)[:, None]

    def pretravel(self, normal: np.ndarray) -> float:
        """Along the normal of a face."""
        around = np.hypot(normal[0], normal[1])
        phi = np.arctan2(normal[1], normal[0])
        waves = (
            np.cos(self.orders * phi) @ self.lobes[:, 0]
            + np.sin(self.orders * phi) @ self.lobes[:, 1]
        )
        return float(around * (self.mean + waves) + (1.0 - around) * 1.0 * MICROMETRE)

    def faces(
        self, turn: float, tilt: np.ndarray
    ) -> dict[tuple[int, int], tuple[np.ndarray, float]]:
        """Normal and distance from the middle of each face, with the block turned."""
        b = self.unsquare
        outward = [
            np.array([1.0, b[0], b[1]]),
            np.array([0.0, 1.0, b[2]]),
            np.array([0.0, 0.0, 1.0]),
        ]
        c, s = np.cos(turn), np.sin(turn)
        about = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        lean = np.array(
            [[1.0, -tilt[2], tilt[1]], [tilt[2], 1.0, -tilt[0]], [-tilt[1], tilt[0], 1.0]]
        )
        found = {}
        for axis, normal in enumerate(outward):
            for side in (1, -1):
                own = side * normal
                if side < 0:
                    others = [k for k in range(3) if k != axis]
                    own[others] += self.wedges[axis]
                own = about @ (lean @ (own / np.linalg.norm(own)))
                found[axis, side] = own / np.linalg.norm(own), 0.5 * self.true_lengths[axis]
        return found

    def touches(self, plan: BlockPlan) -> Touches:
        """Run a plan: each touch with the axes moved to its start and along its approach."""
        rng, count = self.rng, len(plan.points)
        placed = {}
        table = np.zeros(3)
        latched = []
        true_from_screw = np.eye(3) + np.diag(self.scale)
        true_from_screw[0, 1], true_from_screw[0, 2], true_from_screw[1, 2] = self.shear
        for row in range(count):
            word, turn = plan.references[row], plan.turns[row]
            key = word.partition("@")[2]
            if key not in placed:
                tilt = rng.normal(0.0, 50e-6, 3) * [1.0, 1.0, 20.0]
                placed[key] = rng.normal(0.0, 0.2, 3), self.faces(turn, tilt)
            middle, faces = placed[key]
            normal = plan.normals[row]
            axis, side = plan.faces[row]
            outward, half = faces[axis, side]
            if word.startswith("plate"):
                outward, half = -outward, -half
            time = row / max(count - 1, 1)
            noise = rng.normal(0.0, self.noise)
            drift = self.warming * (1.0 - np.exp(-time / (self.warms_up * 0.5)))
            travel = self.pretravel(outward)
            approach = plan.approaches[row]
            contact = plan.points[row] + 0.5 * TIP_DIAMETER * normal

            far = half + 0.5 * TIP_DIAMETER - travel - noise + outward @ (middle + drift)
            face = _Face(outward @ true_from_screw, float(far))
            # The screw goes to the start from where it was, then along the approach.
            screw = contact - approach * 5.0
            table = _dragged(table, screw, self.backlash)
            low, high = 0.0, 7.0
            end = contact + approach * 2.0
            after = _dragged(table, end, self.backlash)
            assert face.gap(after) < 0.0 < face.gap(table)
            for _ in range(45):
                middle_way = 0.5 * (low + high)
                # The way is monotonous on each axis: the nut follows the screw by its play.
                nut = _dragged(table, screw + approach * middle_way, self.backlash)
                low, high = (middle_way, high) if face.gap(nut) > 0.0 else (low, middle_way)
            at = screw + approach * high
            table = _dragged(table, at, self.backlash)
            latched.append(self.step * np.round(at / self.step))
        return Touches(np.array(latched), plan.normals, plan.approaches,
                       references=tuple(plan.references))  # fmt: skip

    def with_screw(
        self, touches: Touches, amplitude: float, *, moved: bool, pitch: float = 5.0
    ) -> Touches:
        """The same touches on screws that repeat an error with each revolution.

        Moved: in each orientation the block stands up to 5 mm elsewhere along each axis.
        """
        latched = np.array(touches.positions)
        at = latched + self.rng.uniform(-200.0, 200.0, 3)
        names = [word.partition("@")[2] for word in touches.references or ()]
        for turn in dict.fromkeys(names) if moved else ():
            rows = [name == turn for name in names]
            elsewhere = self.rng.uniform(-5.0, 5.0, 3)
            latched[rows] += elsewhere
            at[rows] += elsewhere
        phase = self.rng.uniform(0.0, 1.0, 3)
        latched += amplitude * np.sin(2.0 * np.pi * (at / pitch + phase))
        return replace(touches, positions=latched)

    def touched(self, points: np.ndarray, normals: np.ndarray) -> Touches:
        """Touches along the normals on points of other surfaces, each from afar, without a drift.

        The spindle point is known; the screw is where the machine's errors put it there.
        """
        true_from_screw = np.eye(3) + np.diag(self.scale)
        true_from_screw[0, 1], true_from_screw[0, 2], true_from_screw[1, 2] = self.shear
        travel = np.array([self.pretravel(normal) for normal in normals])
        travel = travel + self.rng.normal(0.0, self.noise, len(normals))
        spindle = points + (0.5 * TIP_DIAMETER - travel)[:, None] * normals
        last_move = np.where(np.abs(normals) > 1e-3, -np.sign(normals), 0.0)
        screw = np.linalg.solve(true_from_screw, spindle.T).T + 0.5 * self.backlash * last_move
        return Touches(self.step * np.round(screw / self.step), normals)

    @property
    def truth(self) -> np.ndarray:
        """In the order of the terms."""
        return np.concatenate([self.scale, self.shear, self.backlash])


@dataclass(frozen=True)
class _Face:
    """A face as the nut sees it: the trigger comes where this gap is closed."""

    normal: np.ndarray
    far: float

    def gap(self, nut: np.ndarray) -> float:
        return float(self.normal @ nut) - self.far


def _dragged(nut: np.ndarray, screw: np.ndarray, backlash: np.ndarray) -> np.ndarray:
    """Where the nut is after the screw moved: it is dragged by the flank that it meets."""
    return np.clip(nut, screw - 0.5 * backlash, screw + 0.5 * backlash)


def one_set(
    number: int,
    lengths: tuple[float, ...] = LENGTHS,
    *,
    screw: float = 0.0,
    moved: bool = False,
    pitch: float = 5.0,
) -> tuple[Shop, ReferenceFit]:
    """A shop and what the qualification on its block says. The error of the screws is in mm."""
    shop = Shop(np.random.default_rng([38, number]), lengths)
    plan = plan_block(lengths)
    block = Reference("block", "block", lengths, u_size=shop.u_length, u_temperature=0.0)
    touches = shop.touches(plan)
    if screw > 0.0:
        touches = shop.with_screw(touches, screw, moved=moved, pitch=pitch)
    return shop, fit_references(touches, [block], tip_diameter=TIP_DIAMETER)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--screw", type=float, default=0.0, help="amplitude of its error, µm")
    parser.add_argument("--pitch", type=float, default=5.0, help="of the screws, mm")
    parser.add_argument(
        "--moved", action="store_true", help="the block at another place in each orientation"
    )
    given = parser.parse_args()
    said = 0
    held = {name: [0, 0, 0, 0] for name in TERMS}
    pairs = [0, 0]
    sizes: dict[str, list[float]] = {name: [] for name in TERMS}
    for number in range(given.first, given.first + given.sets):
        try:
            screw = given.screw * MICROMETRE
            shop, found = one_set(number, screw=screw, moved=given.moved, pitch=given.pitch)
        except PretravelError as error:
            print(number, error)
            continue
        repeating = any("repeat at the same place" in words for words in found.warnings)
        said += repeating
        for term, truth in zip(found.terms, shop.truth, strict=True):
            if not term.determined:
                held[term.name][2] += 1
                continue
            held[term.name][1] += 1
            inside = abs(term.value - truth) <= term.expanded
            held[term.name][0] += inside
            alone = any("at few places" in words for words in found.warnings)
            held[term.name][3] += not inside and not (repeating or alone)
            sizes[term.name].append(term.expanded)
        for pair in found.pairs:
            words = pair.name.removeprefix("pretravel of ").partition(" together")[0].split(" and ")
            if words != ["+x", "-x"]:
                continue
            x = np.array([1.0, 0.0, 0.0])
            truth = shop.pretravel(x) + shop.pretravel(-x)
            if "backlash" in pair.name:
                truth += shop.backlash[0]
            pairs[0] += abs(pair.value - truth) <= pair.expanded
            pairs[1] += 1
    print(f"{'term':26} within U  stated  not determined  outside, not said  median U")
    for name, (inside, stated, refused, silent) in held.items():
        share = f"{100.0 * inside / stated:6.1f} %" if stated else "      –"
        unit = 1e3 if name.startswith("backlash") else 1e6
        u = f"{unit * np.median(sizes[name]):.1f}" if stated else "–"
        u += " µm" if unit == 1e3 else " ppm"
        print(f"{name:26} {share}  {stated:6d}  {refused:14d}  {silent:17d}  {u}")
    print(f"errors of the screws are named in {said} sets")
    print(
        f"pretravel of +x and -x      {100.0 * pairs[0] / max(pairs[1], 1):6.1f} %  {pairs[1]:6d}"
    )


if __name__ == "__main__":
    main()
