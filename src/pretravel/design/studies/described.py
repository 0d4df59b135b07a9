"""The description of a found design: the text of its start, with other numbers."""

from __future__ import annotations

from pathlib import Path

from pretravel.design.studies.definition import put
from pretravel.design.studies.design_search import FoundDesign
from pretravel.prediction import catalogue_names, source_text


def found_description(found: FoundDesign) -> str:
    """TOML of the best design; comments and other numbers stay as in the start's description.

    Returns
    -------
    str
        What ``pretravel predict`` takes. A path to a STEP file stays relative to the start's file.
    """
    import tomlkit

    study = found.wish.study
    is_name = study.probe in catalogue_names()
    path = study.probe if is_name else study.folder / Path(study.probe).name
    document = tomlkit.parse(source_text(path))
    sources = document.setdefault("sources", tomlkit.table())
    for key, value in found.best.levels.items():
        table = key.partition(".")[0]
        if table in ("prediction", "touch", "calibration"):
            continue
        put(document, key, value if isinstance(value, str) else float(f"{value:.9g}"))
        sources[key] = f"designed for the specification '{study.name}'"
    # The start's name can state a length or a material that is no longer true.
    document["name"] = f"{study.name}, designed from {study.probe}"
    return tomlkit.dumps(document)
