"""Ren 2020, Figure 6: the terms of the pretravel over the trigger force.

Equation 12 with the numbers of section 4. The dashed lines are equation 13 as it is printed, with
its two terms of Hertz ten times too small. The paper reads off its figure that the bending is the
largest term from 0.003 N on.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.prediction.compliance.ren import RenProbe, RenTerms, ren_terms_of

FORCE = np.geomspace(1e-8, 0.2, 400)
PRINTED = RenTerms(rigid=6.41e-5, bending=0.012376, compression=1.83e-5)


STATEMENT = Statement(
    "force from which the bending exceeds the rotation / mN",
    "3 (read off Figure 6)",
    "Ren 2020, section 3.5; (L_c / L_p)³ of its equation 12",
    0.138,
    0.140,
    "closed form, of inputs with three digits; the published number does not follow from them",
)


def compute() -> RenTerms:
    """The coefficients of equation 12, section 4."""
    return ren_terms_of(
        RenProbe(
            lever=18.0,
            lever_ratio=1.5,
            stylus_diameter=2.0,
            stylus_modulus=200e3,
            contact_coefficient=0.9744,
            seat_radii=(1.0, 1.0),
            seat_moduli=(200e3, 200e3),
            tip_radius=4.0,
            tip_modulus=620e3,
            part_modulus=200e3,
        )
    )


def stated(terms: RenTerms) -> float:
    """The crossover in mN."""
    return 1e3 * terms.crossover()


def draw(terms: RenTerms) -> Figure:
    """All terms over the force, and enlarged near the crossover."""
    figure = Figure(figsize=(10, 4.5), layout="constrained", dpi=110)
    for axes, largest in zip(figure.subplots(1, 2), (0.2, 1e-3), strict=True):
        force = FORCE[largest >= FORCE]
        for each, style in ((terms, "-"), (PRINTED, "--")):
            note = "" if style == "-" else ", as printed"
            curved = force ** (2.0 / 3.0)
            axes.plot(force, 1e3 * each.rigid * curved, "C0" + style, label="rotation L_c" + note)
            axes.plot(force, 1e3 * each.bending * force, "C1" + style, label="bending L_p" + note)
            axes.plot(
                force, 1e3 * each.compression * curved, "C2" + style, label="compression L_k" + note
            )
        axes.set_xlabel("trigger force / N")
        axes.set_ylabel("part of the pretravel / µm")
        axes.set_xlim(0.0, largest)
        axes.grid(alpha=0.3)
    axes.axvline(terms.crossover(), color="k", lw=0.8)
    axes.legend(fontsize=8)
    figure.suptitle("Ren 2020, Figure 6", fontsize=11)
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "ren_fig_6.png", draw(found), STATEMENT, stated(found))
