"""Maps as text files (JSON): everything that is needed to use a map, with all digits.

The file has one line for each number of a list and one for each row of a matrix, so that two maps
are compared line by line. Nothing but NumPy and the standard library is needed to read it.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    MOST_MEMORY,
    FloatArray,
    Placement,
    PretravelError,
    checked_rotation,
    memory_of_json,
    parsed_json,
    whole_file,
)
from pretravel.files.source_file import SourceFile

if TYPE_CHECKING:  # the numbers of a file are read without them
    from pretravel.maps import (
        DirectionSupport,
        MachineTerms,
        PretravelMap,
        Provenance,
        StoredBasis,
    )
    from pretravel.uncertainty import Covariance

SCHEMA, MAP_VERSION = "pretravel map", 1
TIPS_SCHEMA = "pretravel tips"
"""Of a file with the maps of several tips."""
LARGEST_MAP = 64_000_000
"""Largest size of a file; a map of a million directions has it. [bytes]"""
_DEEPEST = 16
"""Most brackets that may be open at once; a map has 5."""
_DIGEST = "content_sha256"
_INFINITE = "infinite"
"""Degrees of freedom of a repeatability that was given."""
_KEYS = frozenset({
    "schema", "version", "kind", "tip_radius_mm", "u_tip_radius_mm", "repeatability_mm",
    "repeatability_dof", "fixed_scatter_mm", "feed_mm_min", "delay_s", "u_delay_s", "provenance",
    "rotation", "basis", "coefficients_mm", "covariance_form", "covariance_mm2",
    "delay_effect_mm", "machine", "support", "touched_mm", "touched_count", _DIGEST,
})  # fmt: skip
_DAMAGED = (
    "this map was damaged or edited after it was written (its checksum does not fit); "
    "qualify or predict again"
)


def write_json_map(path: str | Path, pretravel_map: PretravelMap) -> None:
    """Write a map whole; see docs/formats.md.

    Raises
    ------
    PretravelError
        As `json_of_map`.
    """
    written = json_of_map(pretravel_map)
    with whole_file(path) as temporary:
        temporary.write_bytes(written)


def json_of_map(pretravel_map: PretravelMap) -> bytes:
    r"""The content of the file of a map.

    Returns
    -------
    bytes
        UTF-8.

    Raises
    ------
    PretravelError
        The map is larger than the reader accepts, or contains a number that is not finite.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps import DirectionSupport, PretravelMap
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty import Covariance
    >>> made = PretravelMap(
    ...     MeanBasis(), np.array([0.016]), Covariance.independent([1e-8]),
    ...     DirectionSupport(sphere_pattern_25()), tip_radius=3.0)
    >>> content = json_of_map(made)
    >>> print(*content.decode().splitlines()[:4], sep="\n")
    {
     "schema": "pretravel map",
     "version": 1,
     "kind": "mean",
    >>> map_from_json(SourceFile("map.json", content)).coefficients.tolist()
    [0.016]
    """
    content = _content(pretravel_map)
    try:
        text = "\n".join(_lines(content | {_DIGEST: _digest(content)})) + "\n"
    except ValueError:
        raise PretravelError(
            "the map contains a number that is not finite; a file cannot keep it"
        ) from None
    written = text.encode()
    if len(written) > LARGEST_MAP or memory_of_json(written) > MOST_MEMORY:
        raise PretravelError(
            f"the map needs a file of {len(written) / 1e6:.0f} MB; at most "
            f"{LARGEST_MAP / 1e6:.0f} MB, with values of {MOST_MEMORY / 1e6:.0f} MB, are read: use "
            "fewer directions"
        )
    return written


def map_from_json(file: SourceFile) -> PretravelMap:
    """The map that `write_json_map` wrote.

    Raises
    ------
    InputError
        Not such a file; one that was changed after it was written; content that no map has.
    """
    with _faults_of(file):
        return _restored(_checked(_parsed(file.content)))


def numbers_of_map(file: SourceFile) -> tuple[FloatArray, FloatArray]:
    """Coefficients and rotation in the file of a map, without the map.

    Raises
    ------
    InputError
        As `map_from_json`.
    """
    with _faults_of(file):
        content = _checked(_parsed(file.content))
        return _floats(content, "coefficients_mm", 1), _floats(content, "rotation", 2)


@contextmanager
def _faults_of(file: SourceFile) -> Iterator[None]:
    """Content that no map has is refused: a missing name, another type, sizes that do not fit."""
    try:
        with file.named_in_errors():
            yield
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        if isinstance(error, PretravelError):
            raise
        raise file.error(
            f"this is not a map that can be read; {type(error).__name__}: {error!s:.200}"
        ) from error


def _content(pretravel_map: PretravelMap) -> dict[str, Any]:
    """All but the digest, in the order of the file."""
    basis = pretravel_map.basis
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "version": MAP_VERSION,
        "kind": pretravel_map.kind,
        "tip_radius_mm": float(pretravel_map.tip_radius),
        "u_tip_radius_mm": float(pretravel_map.u_tip_radius),
        "repeatability_mm": float(pretravel_map.repeatability),
        "repeatability_dof": (
            _INFINITE
            if pretravel_map.repeatability_dof == math.inf
            else float(pretravel_map.repeatability_dof)
        ),
        "fixed_scatter_mm": float(pretravel_map.fixed_scatter),
    }
    if pretravel_map.feed is not None:
        content["feed_mm_min"] = float(pretravel_map.feed)
    if pretravel_map.delay is not None:
        content["delay_s"] = float(pretravel_map.delay)
        content["u_delay_s"] = float(pretravel_map.u_delay)
    arrays = {
        name: {"unit": array.unit, "values": np.asarray(array.values).tolist()}
        for name, array in basis.arrays().items()
    }
    content |= {
        "provenance": pretravel_map.provenance.as_dict(),
        "rotation": pretravel_map.rotation.tolist(),
        "basis": {"attributes": dict(basis.attributes()), "arrays": arrays},
        "coefficients_mm": pretravel_map.coefficients.tolist(),
        "covariance_form": pretravel_map.covariance.correlation.value,
        "covariance_mm2": [],  # in its place; it has most of the numbers, and is plain already
    }
    if pretravel_map.delay_effect is not None:
        content["delay_effect_mm"] = pretravel_map.delay_effect.tolist()
    if pretravel_map.machine is not None:
        content["machine"] = _machine_content(pretravel_map.machine)
    content["support"] = pretravel_map.support.nodes.tolist()
    if pretravel_map.touched is not None:
        content["touched_mm"] = pretravel_map.touched.pretravel.tolist()
        content["touched_count"] = pretravel_map.touched.counts.astype(np.int64).tolist()
    # What NumPy and tuples become in JSON, so that the digest is that of the file.
    plain: dict[str, Any] = json.loads(json.dumps(content, default=_plain))
    plain["covariance_mm2"] = pretravel_map.covariance.values.tolist()
    return plain


def _machine_content(machine: MachineTerms) -> dict[str, Any]:
    from pretravel.maps import TERMS

    return {
        "terms": list(TERMS),
        "values": machine.values.tolist(),
        "root": machine.root.tolist(),
        "origin_mm": machine.origin.tolist(),
        "reach_mm": [float(machine.reach)],
        "rotation": machine.placement.rotation.tolist(),
        "shift_mm": machine.placement.shift.tolist(),
    }


def _machine(content: Mapping[str, Any]) -> MachineTerms | None:
    from pretravel.maps import TERMS, MachineTerms

    if "machine" not in content:
        return None
    stated = _object(content, "machine")
    if stated.get("terms") != list(TERMS):
        raise PretravelError(f"the key machine: its terms must be {', '.join(TERMS)}")
    place = Placement(_floats(stated, "rotation", 2), _floats(stated, "shift_mm", 1))
    return MachineTerms(
        _floats(stated, "values", 1),
        _floats(stated, "root", 2),
        _floats(stated, "origin_mm", 1),
        float(_floats(stated, "reach_mm", 1)[0]),
        replace(place, rotation=checked_rotation(place.rotation)),
    )


def _plain(value: object) -> Any:
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"a map cannot keep a {type(value).__name__}")


def _digest(content: Mapping[str, Any]) -> str:
    """SHA-256 of the content without its digest: keys sorted, no blanks, ASCII."""
    own = {name: value for name, value in content.items() if name != _DIGEST}
    text = json.dumps(own, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _lines(content: Mapping[str, Any], depth: int = 0) -> Iterator[str]:
    """The text of an object: a line for each number of a list and for each row of a matrix."""
    outer, inner = " " * depth, " " * (depth + 1)
    if depth == 0:
        yield "{"
    last = len(content) - 1
    for number, (name, value) in enumerate(content.items()):
        key, comma = f"{inner}{_text(name)}: ", "," * (number < last)
        if isinstance(value, Mapping) and value:
            yield f"{key}{{"
            yield from _lines(value, depth + 1)
            yield f"{inner}}}{comma}"
        elif isinstance(value, list) and value:
            yield f"{key}["
            yield from (
                f"{inner} {_text(each)}{',' * (row < len(value) - 1)}"
                for row, each in enumerate(value)
            )
            yield f"{inner}]{comma}"
        else:
            yield f"{key}{_text(value)}{comma}"
    if depth == 0:
        yield f"{outer}}}"


def _text(value: Any) -> str:
    """A value on one line. Names of files that are not Unicode keep their escapes."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    try:
        text.encode()
    except UnicodeEncodeError:
        return json.dumps(value)
    return text


def _parsed(content: bytes) -> dict[str, Any]:
    """The object of a file; refuses what is too large, too deep, ambiguous or no JSON."""
    if len(content) > LARGEST_MAP:
        raise PretravelError(
            f"the file has {len(content) / 1e6:.0f} MB; a map has at most {LARGEST_MAP / 1e6:.0f}"
        )
    if not content.strip():
        raise PretravelError("the file is empty; a map is needed")
    _check_depth(content)
    try:
        found = parsed_json(content, parse_constant=_refuse_constant, object_pairs_hook=_distinct)
    except ValueError as error:
        if isinstance(error, PretravelError):
            raise
        raise PretravelError(f"this is not a map: not a text in JSON ({error!s:.120})") from None
    if not isinstance(found, dict):
        raise PretravelError("this is not a map: no JSON object with names and values")
    return found


def _check_depth(content: bytes) -> None:
    # Brackets within texts do not count, but few files have any.
    if _depth(content) > _DEEPEST and _depth(_TEXTS.sub(b"", content)) > _DEEPEST:
        raise PretravelError(f"this is not a map: more than {_DEEPEST} levels of nested brackets")


def _depth(content: bytes) -> int:
    """Most brackets that are open at once."""
    steps = _STEPS[np.frombuffer(content, dtype=np.uint8)]
    return int(np.max(np.cumsum(steps[steps != 0], dtype=np.int32), initial=0))


_STEPS = np.zeros(256, dtype=np.int8)
_STEPS[list(b"[{")], _STEPS[list(b"]}")] = 1, -1
_TEXTS = re.compile(rb'"(?:[^"\\]|\\.)*+(?:"|\\?\Z)', re.DOTALL)
"""Texts of JSON, also one without its end: each sign is looked at once."""


def _refuse_constant(word: str) -> NoReturn:
    raise PretravelError(f"the file contains the word {word}; all numbers of a map are finite")


def _distinct(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise PretravelError(f"the key {name!r:.60} is there twice")
        found[name] = value
    return found


def _checked(content: dict[str, Any]) -> dict[str, Any]:
    """The content, if it is that of a map of this version and was not changed."""
    if content.get("schema") == TIPS_SCHEMA:
        raise PretravelError(
            "this file has the maps of several tips, and a map of one tip is needed: qualify "
            "the touches of one tip alone, with its name, its diameter and its axis (tip to hub)"
        )
    if content.get("schema") != SCHEMA:
        raise PretravelError(
            f"this is not a pretravel map (the key schema is not '{SCHEMA}'); "
            "pretravel qualify and pretravel predict write them"
        )
    version = content.get("version")
    if type(version) is not int or version != MAP_VERSION:
        raise PretravelError(
            f"the key version is {version!r:.60}; this version of pretravel reads maps of version "
            f"{MAP_VERSION}"
        )
    unknown = [name for name in content if name not in _KEYS]
    if unknown:
        raise PretravelError(f"the key {unknown[0]!r:.60} is not known")
    try:
        digest = _digest(content)
    except ValueError:  # 1e999 is infinite
        raise PretravelError("a number of the file is too large") from None
    if digest != content.get(_DIGEST):
        raise PretravelError(_DAMAGED)
    return content


def _restored(content: Mapping[str, Any]) -> PretravelMap:
    from pretravel.maps import DirectionSupport, PretravelMap, TouchedMeans, restored_basis

    support = DirectionSupport(_floats(content, "support", 2))
    has_delay, has_effect = "delay_s" in content, "delay_effect_mm" in content
    touched = None
    if "touched_mm" in content or "touched_count" in content:
        counts = _floats(content, "touched_count", 1)
        touched = TouchedMeans(_floats(content, "touched_mm", 1), counts)
    return PretravelMap(
        basis=restored_basis(_word(content, "kind"), _stored_basis(content, support)),
        coefficients=_floats(content, "coefficients_mm", 1),
        covariance=_covariance(content),
        support=support,
        tip_radius=_number(content, "tip_radius_mm"),
        u_tip_radius=_number(content, "u_tip_radius_mm"),
        repeatability=_number(content, "repeatability_mm"),
        repeatability_dof=(
            math.inf
            if content.get("repeatability_dof") == _INFINITE
            else _number(content, "repeatability_dof")
        ),
        fixed_scatter=_number(content, "fixed_scatter_mm"),
        rotation=_floats(content, "rotation", 2),
        feed=_number(content, "feed_mm_min") if "feed_mm_min" in content else None,
        delay=_number(content, "delay_s") if has_delay else None,
        u_delay=_number(content, "u_delay_s") if has_delay else 0.0,
        delay_effect=_floats(content, "delay_effect_mm", 1) if has_effect else None,
        machine=_machine(content),
        touched=touched,
        provenance=_provenance(_object(content, "provenance")),
    )


def _stated(content: Mapping[str, Any], name: str) -> Any:
    if name not in content:
        raise PretravelError(f"the key {name} is missing")
    return content[name]


def _word(content: Mapping[str, Any], name: str) -> str:
    value = _stated(content, name)
    if not isinstance(value, str):
        raise PretravelError(f"the key {name} must be a text, not {value!r:.60}")
    return value


def _object(content: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = _stated(content, name)
    if not isinstance(value, dict):
        raise PretravelError(f"the key {name} must be an object, not {value!r:.60}")
    return value


def _number(content: Mapping[str, Any], name: str) -> float:
    """One finite number, not negative."""
    value = _stated(content, name)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PretravelError(f"the key {name} must be one number, not {value!r:.60}")
    if not 0.0 <= value < math.inf:
        raise PretravelError(f"the key {name} is {value:g}; it must be finite and positive")
    return float(value)


def _floats(content: Mapping[str, Any], name: str, axes: int) -> FloatArray:
    values = _array(_stated(content, name), name)
    if values.dtype.kind not in "fi" or values.ndim != axes:
        raise PretravelError(
            f"the key {name} must have {axes} axes and contain numbers; "
            f"it has the shape {values.shape} and the type {values.dtype}"
        )
    return np.asarray(values, dtype=np.float64)


def _array(value: Any, name: str) -> npt.NDArray[Any]:
    """A number, a list or a matrix: of whole numbers, of numbers or of texts, not of a mixture."""
    rows = value if isinstance(value, list) else [value]
    flat: Sequence[Any] = rows
    shape: tuple[int, ...] = (len(rows),) if rows is value else ()
    if rows and all(isinstance(row, list) for row in rows):
        if len({len(row) for row in rows}) > 1:
            raise PretravelError(f"the key {name}: its rows have different lengths")
        flat, shape = [cell for row in rows for cell in row], (len(rows), len(rows[0]))
    types = {type(cell) for cell in flat}
    if not (types <= {int, float} or types == {str}):
        wrong = next(cell for cell in flat if type(cell) not in (int, float))
        raise PretravelError(f"the key {name} contains {wrong!r:.60}, which is not a number")
    if types == {str}:
        return np.array(flat, dtype=object).reshape(shape)
    if types == {int}:
        if max(map(abs, flat)) >= 2**53:
            raise PretravelError(f"the key {name} contains a number that is too large")
        return np.array(flat, dtype=np.int64).reshape(shape)
    return np.array(flat, dtype=np.float64).reshape(shape)


def _stored_basis(content: Mapping[str, Any], support: DirectionSupport) -> StoredBasis:
    from pretravel.maps import StoredArray, StoredBasis

    basis = _object(content, "basis")
    attributes = _object(basis, "attributes")
    for name, value in attributes.items():
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise PretravelError(f"the key {name:.60} must be a number or a text")
    arrays = {}
    for name, stated in _object(basis, "arrays").items():
        if not isinstance(stated, dict) or set(stated) != {"unit", "values"}:
            raise PretravelError(f"the key {name:.60} must have a unit and values")
        values = _array(stated["values"], name)
        axes = tuple(f"{name}_{axis}" for axis in range(values.ndim))
        arrays[name] = StoredArray(axes, values, _word(stated, "unit"))
    return StoredBasis(support, _number(content, "tip_radius_mm"), arrays, attributes)


def _covariance(content: Mapping[str, Any]) -> Covariance:
    from pretravel.uncertainty import Correlation, Covariance

    stated = _word(content, "covariance_form")
    known = [form.value for form in Correlation]
    if stated not in known:
        raise PretravelError(
            f"the key covariance_form is {stated!r:.60}; there are {', '.join(known)}"
        )
    form = Correlation(stated)
    values = _floats(content, "covariance_mm2", 2 if form is Correlation.FULL else 1)
    return Covariance.full(values) if form is Correlation.FULL else Covariance(form, values)


def _provenance(stated: Mapping[str, Any]) -> Provenance:
    from pretravel.maps import Provenance

    try:
        found = Provenance.from_dict(stated)
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise PretravelError(f"the key provenance cannot be read: {error!s:.200}") from None
    for entry in fields(Provenance):
        usual, value = getattr(Provenance(), entry.name), getattr(found, entry.name)
        if entry.name == "spindle_deg":
            if isinstance(value, int) and not isinstance(value, bool):
                value = float(value)
            usual = None if value is None else 0.0
        # These are checked where they are read.
        read = ("setup", "center_covariance", "center")
        if entry.name not in read and not isinstance(value, type(usual)):
            raise PretravelError(
                f"the key provenance: {entry.name} must be of the type "
                f"{type(usual).__name__}, not {value!r:.60}"
            )
    return found
