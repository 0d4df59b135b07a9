"""Whether a picture shows data: charts draw them in colour, their axes and texts in grey."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image


def coloured_share(path: Path | str) -> float:
    """Of the pixels of an image file, 0 to 1; nothing but axes and texts has less than 1e-3."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=np.int64)
    return float(np.mean(np.ptp(pixels, axis=2) > 40))
