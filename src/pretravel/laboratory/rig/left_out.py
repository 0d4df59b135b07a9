"""What was left out of a calibration on the rig, and the effect of the outliers on it."""

from __future__ import annotations

import math

from pretravel.base import MICROMETRE
from pretravel.laboratory.rig.calibration import RigCalibration


def left_out_sentences(calibration: RigCalibration) -> list[str]:
    """What was left out of a calibration, and the effect of the outliers on it."""
    sentences = []
    if calibration.excluded:
        sentences.append(f"left out as requested: {', '.join(calibration.excluded)}")
    sentences += list(dict.fromkeys(outlier.message for outlier in calibration.outliers))
    lost = calibration.with_outliers
    if lost is None:
        return sentences
    them = "it" if len(calibration.outliers) == 1 else "them"
    changes = [
        f"{name} would be {with_it / MICROMETRE:.3g} µm instead of {own / MICROMETRE:.3g} µm"
        for name, with_it, own in (
            ("repeatability", lost.repeatability.value, calibration.repeatability.value),
            ("u of a direction", _largest_u(lost), _largest_u(calibration)),
            ("anisotropy", lost.anisotropy, calibration.anisotropy),
        )
        if math.isfinite(with_it) and math.isfinite(own)
    ]
    sentences.append(f"with {them}, {', '.join(changes)}")
    names = {direction.name for direction in calibration.directions}
    missing = [d.name for d in lost.directions if d.name not in names]
    if missing:
        sentences.append(f"no touch is left of {', '.join(missing)}; touch again there")
    return sentences


def _largest_u(calibration: RigCalibration) -> float:
    return max(direction.u_pretravel for direction in calibration.directions)
