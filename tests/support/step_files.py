"""STEP files with assemblies, instances and several roots, from solids of the CAD kernel.

The kernel writes files of one product alone. Here the text of several is joined, and the products
are placed in each other as ISO 10303-44 states it.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

_ENTITY = re.compile(r"#(\d+)")
_MADE_BY = re.compile(r"'Open CASCADE STEP translator [^']*'")


@dataclass(frozen=True, eq=False)
class StepPart:
    """A product with a shape: the same object used twice is written once, with two instances."""

    name: str
    shape: Any


@dataclass(frozen=True, eq=False)
class StepAssembly:
    """A product that consists of others, each with its placement (4, 4) in it. [mm]"""

    name: str
    children: Sequence[tuple[StepPart | StepAssembly, np.ndarray]]


@dataclass
class _Written:
    lines: list[str] = field(default_factory=list)
    known: dict[int, tuple[str, str]] = field(default_factory=dict)
    """Of each product: its PRODUCT_DEFINITION and its representation."""
    next: int = 1000

    def add(self, text: str) -> str:
        self.next += 1
        self.lines.append(f"#{self.next}={text};")
        return f"#{self.next}"


def placement(
    x: float = 0.0, y: float = 0.0, z: float = 0.0, *, turn: float = 0.0, axis: str = "z"
) -> np.ndarray:
    """A turn about an axis through the origin, then a shift, (4, 4). [mm, degrees]"""
    from scipy.spatial.transform import Rotation

    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler(axis, turn, degrees=True).as_matrix()
    matrix[:3, 3] = x, y, z
    return matrix


def write_step(path: Path, roots: Sequence[StepPart | StepAssembly]) -> Path:
    """Write products; each of the given ones is a root of the file."""
    written = _Written()
    for name, text in _HEAD:
        assert written.add(text) == name
    for root in roots:
        _product(written, root)
    path.write_text(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
        "FILE_NAME('made','2026-01-01T00:00:00',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
        + "\n".join(written.lines)
        + "\nENDSEC;\nEND-ISO-10303-21;\n",
        encoding="ascii",
    )
    return path


_CONTEXT = (
    "( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#1007)) "
    "GLOBAL_UNIT_ASSIGNED_CONTEXT((#1004,#1005,#1006)) REPRESENTATION_CONTEXT('','') )"
)
_HEAD = (
    ("#1001", "APPLICATION_CONTEXT('automotive design')"),
    ("#1002", "PRODUCT_CONTEXT('',#1001,'mechanical')"),
    ("#1003", "PRODUCT_DEFINITION_CONTEXT('part definition',#1001,'design')"),
    ("#1004", "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"),
    ("#1005", "( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) )"),
    ("#1006", "( NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT() )"),
    ("#1007", "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#1004,'','')"),
    ("#1008", _CONTEXT),
)


def _product(written: _Written, product: StepPart | StepAssembly) -> tuple[str, str]:
    """Write a product once; its definition and representation."""
    if id(product) not in written.known:
        write = _part if isinstance(product, StepPart) else _assembly
        written.known[id(product)] = write(written, product)  # type: ignore[arg-type]
    return written.known[id(product)]


def _part(written: _Written, part: StepPart) -> tuple[str, str]:
    """The kernel's own text, with other numbers and the name of the part."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.step"
        part.shape.WriteStep(str(file))
        text = file.read_text("ascii").replace("\n", "")
    data = text.split("DATA;")[1].split("ENDSEC;")[0]
    data = _MADE_BY.sub(f"'{part.name}'", data)
    first = written.next
    data = _ENTITY.sub(lambda match: f"#{int(match[1]) + first}", data)
    written.next = max(int(number) for number in _ENTITY.findall(data))
    written.lines += [entity.strip() + ";" for entity in data.split(";") if entity.strip()]
    shape = re.search(r"SHAPE_DEFINITION_REPRESENTATION\((#\d+),(#\d+)\)", data)
    assert shape is not None
    definition = re.search(shape[1] + r" = PRODUCT_DEFINITION_SHAPE\([^#]*(#\d+)\)", data)
    assert definition is not None
    return definition[1], shape[2]


def _frame(written: _Written, matrix: np.ndarray) -> str:
    point, z, x = (
        written.add(f"{kind}('',({','.join(f'{value + 0.0:.15f}' for value in values)}))")
        for kind, values in (
            ("CARTESIAN_POINT", matrix[:3, 3]),
            ("DIRECTION", matrix[:3, 2]),
            ("DIRECTION", matrix[:3, 0]),
        )
    )
    return written.add(f"AXIS2_PLACEMENT_3D('',{point},{z},{x})")


def _assembly(written: _Written, assembly: StepAssembly) -> tuple[str, str]:
    children = [(_product(written, child), child.name, at) for child, at in assembly.children]
    product = written.add(f"PRODUCT('{assembly.name}','{assembly.name}','',(#1002))")
    formation = written.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    definition = written.add(f"PRODUCT_DEFINITION('design','',{formation},#1003)")
    shape = written.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    origin = _frame(written, np.eye(4))
    frames = [_frame(written, at) for _, _, at in children]
    items = ",".join([origin, *frames])
    own = written.add(f"SHAPE_REPRESENTATION('',({items}),#1008)")
    written.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{own})")
    for number, (((part, theirs), name, _), frame) in enumerate(zip(children, frames, strict=True)):
        moved = written.add(f"ITEM_DEFINED_TRANSFORMATION('','',{origin},{frame})")
        relation = written.add(
            f"( REPRESENTATION_RELATIONSHIP('','',{theirs},{own}) "
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved}) "
            "SHAPE_REPRESENTATION_RELATIONSHIP() )"
        )
        use = written.add(
            f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}','{name}','',{definition},{part},$)"
        )
        placed = written.add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
        written.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{placed})")
    return definition, own
