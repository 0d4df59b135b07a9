"""Cache of reduced models on disk, so that a probe is factorised once.

The name of a cached model is a digest of everything that its numbers depend on, so it is never
used for another geometry. The file contains digests of its content: a damaged or foreign file is
detected, reported and recomputed. A folder or a file that another user can write to is not used.
"""

from __future__ import annotations

import hashlib
import json
import logging
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    FOLDER_VARIABLE,
    FloatArray,
    PretravelError,
    cache_folder,
    frozen,
    mistrust,
    one_process_at_a_time,
    private,
    whole_file,
)
from pretravel.design.fem.condensation import ElasticField, ReducedModel, condense
from pretravel.design.fem.elasticity import finite_element_model
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.interface_loads import INTERFACE
from pretravel.design.fem.linear_solvers import check_solver
from pretravel.design.fem.mesh import MeshSettings, mesh_probe
from pretravel.design.fem.seat_ball import ball_correction
from pretravel.design.fem.symmetry import ThreefoldSymmetry
from pretravel.prediction import Material, Probe

log = logging.getLogger(__name__)

CACHE_FORMAT = 5
"""Increased whenever numbers or layout change; models of other formats are not used."""
_UNREADABLE = (
    ArithmeticError,
    MemoryError,
    RuntimeError,
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    EOFError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def reduction_key(probe: Probe, settings: MeshSettings) -> str:
    """Digest of all that a reduced model depends on.

    Preload, criterion, orientation and weight are not part of it: they act on the reduced
    model, but do not change it.

    >>> from dataclasses import replace
    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> same = replace(probe, preload=4.0)
    >>> reduction_key(probe, MeshSettings()) == reduction_key(same, MeshSettings())
    True
    """
    probe.refuse_uneven("a finite-element model")
    tripod = asdict(probe.tripod)
    del tripod["radius_deviations"]
    content: dict[str, Any] = {
        "format": CACHE_FORMAT,
        "interface": INTERFACE,
        "settings": asdict(settings),
        "tripod": tripod,
        "support_angle": probe.seats.support_angle,
        "ball": (
            None
            if probe.seats.contact == "rigid"
            else [probe.seats.ball_radius, asdict(probe.seats.material)]
        ),
        "hub_offset": probe.hub_offset,
        "hub": None if probe.hub is None else asdict(probe.hub),
        "stylus": [asdict(segment) for segment in probe.stylus],
        "tip": [probe.tip.radius, asdict(probe.tip.material)],
    }
    if probe.step is not None:
        step = probe.step
        if not step.path.is_file():
            raise PretravelError(f"{step.path}: no such file; [geometry] step names it")
        content["step"] = [
            hashlib.sha256(step.path.read_bytes()).hexdigest(),
            step.tripod,
            step.stylus,
            step.tip,
            {name: asdict(material) for name, material in step.materials.items()},
        ]
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def reduced_model(
    probe: Probe, settings: MeshSettings | None = None, solver: str = "auto"
) -> ReducedModel:
    """Return the reduced model of a probe, from the cache or newly made.

    Parameters
    ----------
    probe : Probe
    settings : MeshSettings, optional
    solver : str
        auto, pardiso, cholmod or superlu.

    Returns
    -------
    ReducedModel

    Raises
    ------
    PretravelError
        An unknown solver.
    DescriptionError, InputError, MeshError, CapacityError
        From the steps: description, geometry, mesh, solution.

    Warns
    -----
    UserWarning
        A cached file was damaged or foreign and has been recomputed; the cache cannot
        be written, or other users can write to it: it is then not used, with one warning.
    """
    check_solver(solver)  # also where the model comes from the cache
    settings = settings or MeshSettings()
    return _reduced_model(probe, settings, solver, reduction_key(probe, settings), cache_folder())


@dataclass(frozen=True, eq=False)
class _InMemory:
    """A field that needs no file; unlike a closure, it can go to another process."""

    field: ElasticField

    def __call__(self) -> ElasticField:
        return self.field


def model_in_memory(
    probe: Probe, settings: MeshSettings | None = None, solver: str = "auto"
) -> ReducedModel:
    """The reduced model of a probe, with its mesh in memory: it can be sent to another process.

    Parameters
    ----------
    probe : Probe
    settings : MeshSettings, optional
    solver : str
        auto, pardiso, cholmod or superlu.

    Returns
    -------
    ReducedModel
        From the cache, or new.

    Raises
    ------
    PretravelError
        An unknown solver; solids that cannot be meshed; not enough memory.
    """
    check_solver(solver)
    reduced = reduced_model(probe, settings, solver)
    return replace(reduced, load_field=_InMemory(reduced.load_field()))


@lru_cache(maxsize=16)
def _remembered(key: str, folder: Path) -> dict[str, ReducedModel]:
    del key, folder
    return {}


def _reduced_model(
    probe: Probe, settings: MeshSettings, solver: str, key: str, folder: Path
) -> ReducedModel:
    memory = _remembered(key, folder)
    if "model" in memory:
        return memory["model"]
    path = folder / f"reduced-{key[:32]}.npz"
    doubt = private(folder)

    def make() -> ReducedModel:
        solids, mesh = mesh_probe(probe, settings)
        ball = ball_correction(probe, solver)
        model = condense(finite_element_model(probe, solids, mesh, ball), solver)
        if doubt:
            return model
        log.info("storing the reduced model", extra={"done": 0.92})
        try:
            _write(path, model, key)
        except (OSError, PretravelError) as error:
            _say_not_stored(folder, str(error))
        return model

    if doubt:  # nothing is read or written there
        _say_not_stored(folder, doubt)
        memory["model"] = make()
        return memory["model"]
    kept = _read(path, key, make)
    if kept is not None:
        log.info("reduced model from %s", path)
        memory["model"] = kept
        return kept
    with one_process_at_a_time(path) as waited:
        kept = _read(path, key, make) if waited else None
        model = kept or make()
    memory["model"] = model
    return model


@lru_cache
def _say_not_stored(folder: Path, reason: str) -> None:
    """Once for a folder and a reason."""
    warnings.warn(
        f"the cache {folder} is not used ({reason}), so the next run makes the reduced model "
        f"again. Set {FOLDER_VARIABLE} to use another folder",
        stacklevel=4,
    )


def _write(path: Path, model: ReducedModel, key: str) -> None:
    elastic = model.load_field()
    mesh, symmetry = elastic.mesh, elastic.symmetry
    header: dict[str, Any] = {
        "key": key,
        "summary": dict(model.summary),
        "regions": list(model.flexibility_by_region),
        "region_names": list(mesh.region_names),
        "notes": list(mesh.notes),
        "faces": list(mesh.faces),
        "patch_compliance": model.patch_compliance,
        "ball_correction": model.ball_correction,
        "seat_part": model.seat_part,
        "materials": {name: asdict(value) for name, value in elastic.materials.items()},
    }
    arrays: dict[str, Any] = {
        "by_region": np.stack(list(model.flexibility_by_region.values())),
        "resultants": model.resultants,
        "points": mesh.points,
        "elements": mesh.elements.astype(np.int32),
        "regions": mesh.regions.astype(np.int16),
        "boundary": mesh.boundary.astype(np.int32),
        "quality": mesh.quality.astype(np.float32),
        "modes": elastic.modes,
        **{f"face {name}": nodes for name, nodes in mesh.faces.items()},
    }
    if symmetry is not None:
        arrays |= {"motions": symmetry.motions, "interface": symmetry.interface}
    header["digests"] = {name: _digest(values) for name, values in arrays.items()}
    text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    with whole_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, header=text, header_digest=np.array(_digest(text)), **arrays)
    path.chmod(0o600)


def _digest(values: npt.ArrayLike) -> str:
    """Of the type, shape and content of an array."""
    array = np.ascontiguousarray(values)
    digest = hashlib.sha256(f"{array.dtype.str} {array.shape} ".encode())
    digest.update(array.tobytes())
    return digest.hexdigest()


def _checked(kept: Any, name: str, header: Mapping[str, Any]) -> npt.NDArray[Any]:
    """An array of a cached model, as it was written."""
    values: npt.NDArray[Any] = kept[name]
    if _digest(values) != header["digests"][name]:
        raise ValueError(f"the digest of {name} does not fit")
    return values


def _read(path: Path, key: str, make: Callable[[], ReducedModel]) -> ReducedModel | None:
    """A cached model, or None if there is none that can be used."""
    if not path.is_file():
        return None
    doubt = mistrust(path)
    if doubt:
        warnings.warn(
            f"the cached model {path} is not used, because {doubt}; it is recomputed", stacklevel=4
        )
        return None
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            text = kept["header"]
            if str(kept["header_digest"]) != _digest(text):
                raise ValueError("the digest of its header does not fit")
            header = json.loads(bytes(text))
            if header["key"] != key:
                raise ValueError("it belongs to another model")
            by_region = _checked(kept, "by_region", header)
            resultants = _checked(kept, "resultants", header)
            patch, ball = float(header["patch_compliance"]), float(header["ball_correction"])
        size = len(INTERFACE)
        if (
            by_region.shape != (len(header["regions"]), size, size)
            or resultants.shape != (6, size)
            or not all(np.all(np.isfinite(a)) for a in (by_region, resultants, [patch, ball]))
        ):
            raise ValueError("its arrays have other shapes")
    except _UNREADABLE as error:
        warnings.warn(
            f"the cached model {path} is damaged or foreign ({error}); it is recomputed",
            stacklevel=4,
        )
        return None
    return ReducedModel(
        flexibility=frozen(by_region.sum(axis=0)),
        flexibility_by_region={
            name: frozen(part) for name, part in zip(header["regions"], by_region, strict=True)
        },
        resultants=frozen(resultants),
        patch_compliance=patch,
        ball_correction=ball,
        seat_part=header["seat_part"],
        summary=header["summary"],
        load_field=lambda: _read_field(path, header, make),
    )


def _read_field(
    path: Path, header: Mapping[str, Any], make: Callable[[], ReducedModel]
) -> ElasticField:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            arrays = {
                name: _checked(kept, name, header)
                for name in header["digests"]
                if name not in ("by_region", "resultants")
            }
        mesh = FiniteElementMesh(
            points=frozen(arrays["points"]),
            elements=arrays["elements"].astype(np.int64),
            regions=arrays["regions"].astype(np.int64),
            region_names=tuple(header["region_names"]),
            faces={name: arrays[f"face {name}"] for name in header["faces"]},
            boundary=arrays["boundary"].astype(np.int64),
            quality=arrays["quality"].astype(np.float64),
            notes=tuple(header["notes"]),
        )
        modes: FloatArray = frozen(arrays["modes"])
        symmetry = None
        if "motions" in arrays:
            symmetry = ThreefoldSymmetry(frozen(arrays["motions"]), frozen(arrays["interface"]))
    except _UNREADABLE as error:
        warnings.warn(
            f"the mesh of the cached model {path} is damaged ({error}); it is recomputed",
            stacklevel=4,
        )
        return make().load_field()
    materials = {name: Material(**table) for name, table in header["materials"].items()}
    return ElasticField(mesh, materials, modes, symmetry)
