"""All roots of a STEP file, and the parts that its faces belong to; uses the CAD kernel itself.

The kernel's interface calls the first root of a file its shape. All of them are in its tree of
products, in which every part is placed as its assemblies say.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_UNNAMED = re.compile(r"=>\[[\d:]*\]|")
"""Names that the kernel gives to what has none in the file."""


def whole_shape(file: Path) -> tuple[Any, dict[Any, str]]:
    """The shapes of all roots of a STEP file, as one.

    Parameters
    ----------
    file : Path
        Its name ends with ``.step``, in lower case: the kernel requires it.

    Returns
    -------
    shape : netgen.occ.TopoDS_Shape
        In mm.
    part_of : mapping of netgen.occ.Face to str
        The part of each face, as the path of its assemblies; empty if the file has one part.

    Raises
    ------
    RuntimeError
        From the kernel: a file that it cannot read. A kernel without the tree of products; a tree
        in which the first root lies elsewhere than alone.
    """
    from netgen.occ import Compound, OCCGeometry

    if not hasattr(OCCGeometry, "GetAssemblyTree"):
        raise RuntimeError("it is too old; install netgen-mesher 6.2.2608 or a later version")
    geometry = OCCGeometry(str(file))
    tree = geometry.GetAssemblyTree()
    roots = [] if tree is None else list(tree.children)
    parts = list(_parts(roots, ""))
    part_of = {face: path for path, shape in parts for face in shape.faces}
    missing = sum(face not in part_of for face in geometry.shape.faces)
    if missing and len(roots) > 1:
        raise RuntimeError(
            f"it has {len(roots)} roots, and {missing} faces of the first one are not where the "
            "tree of products places them; export each root as a separate file"
        )
    if len(roots) < 2:
        own = [path for path, shape in parts if shape.faces]
        return geometry.shape, part_of if len(own) > 1 else {}
    return Compound([shape for _, shape in parts]), part_of


def _parts(siblings: list[Any], above: str) -> Iterator[tuple[str, Any]]:
    """The path and the shape of every part below nodes of the kernel's tree, in its order."""
    used: dict[str, int] = {}
    for node in siblings:
        path = above
        if not _UNNAMED.fullmatch(node.name):
            # Two instances can have one name.
            used[node.name] = used.get(node.name, 0) + 1
            own = node.name if used[node.name] == 1 else f"{node.name} ({used[node.name]})"
            path = f"{above}/{own}" if above else own
        children = list(node.children)
        if children:
            yield from _parts(children, path)
        elif node.shape is not None:
            yield path, node.shape
