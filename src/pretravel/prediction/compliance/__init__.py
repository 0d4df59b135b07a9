"""Compliance models: which parts of a probe deform under the trigger force, and by how much.

One file for each model, which holds the model's object as ``MODEL``. A new model is one file
here and one line in `MODELS`.
"""

from __future__ import annotations

from collections.abc import Mapping

MODELS: Mapping[str, str] = {
    "analytic": "stylus as a beam, elastic seats",
    "fem": "finite elements",
    "ren": "closed form of Ren 2020",
    "shen": "stylus as one cantilever, rigid seats",
    "wozniak": "Woźniak's constant, as five touches would determine it; with a contact opening or "
    "a piezo stage in the description, also the stem and the tip's contact",
}
"""Names of the compliance models, each with what it represents. All have the same statics."""
ELSEWHERE = {"fem": "pretravel.design.fem.compliance"}
"""Modules of models that are not in this folder: finite elements belong to the design of probes."""
