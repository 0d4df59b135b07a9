"""The reader of IGES files."""

from __future__ import annotations

import logging
import re
import shutil
import warnings
from pathlib import Path

from pretravel.base import MICROMETRE, InputError, PretravelError, needed, temporary_folder
from pretravel.surface.cad.iges_bodies import SEWING
from pretravel.surface.cad.iges_header import check_iges_header
from pretravel.surface.cad.kernel_process import (
    CadContent,
    kernel_content,
    kernel_message,
    run_kernel,
)

_logger = logging.getLogger("pretravel")

_SURFACES = frozenset((108, 114, 118, 120, 122, 128, 140, 143, 144, 186, 190, 192, 194, 196, 198))
"""Entity types of surfaces and faces."""
_CURVES = frozenset((100, 102, 104, 106, 110, 112, 126, 130))
_POINT = 116


def read_iges(path: str | Path) -> CadContent:
    """Read an IGES file.

    Parameters
    ----------
    path : str or Path
        IGES 5.3 or earlier, in any unit of length.

    Returns
    -------
    CadContent
        Its faces are joined where their edges are at most `SEWING` apart.

    Raises
    ------
    InputError
        A file that is not IGES, that has no surfaces, or that the CAD kernel cannot read.
    MissingExtraError
        Without the extra ``cad``.
    """
    needed("netgen", "cad")
    needed("shapely", "cad")
    path = Path(path)
    types = _entity_types(path)
    if not types & _SURFACES:
        has = [name for name, kinds in (("curves", _CURVES), ("points", {_POINT})) if types & kinds]
        raise InputError(
            f"contains no surfaces{', only ' + ' and '.join(has) if has else ''}; export the part "
            "as a solid or as trimmed surfaces, best as STEP (AP214 or AP242)",
            path=path,
        )
    _logger.info("reading %s", path.name)
    with temporary_folder() as folder:
        copy = folder / "part.iges"  # the kernel recognizes a format by this ending alone
        shutil.copyfile(path, copy)
        kernel = run_kernel(copy, folder)
        if kernel.returncode != 0:
            raise InputError(
                f"the CAD kernel cannot read it: {kernel_message(kernel)}. Export the part as STEP "
                "(AP214 or AP242)",
                path=path,
            )
        content = kernel_content(folder, path)
    if content.open:
        groups = content.open + content.closed
        wording = (
            f"enclose a volume in only {content.closed} of {groups} groups; in the others normals"
            if content.closed
            else "do not enclose a volume; their normals"
        )
        warnings.warn(
            f"{path.name}: the faces, joined where edges are up to {SEWING / MICROMETRE:g} µm "
            f"apart, {wording} are those of the file and can point into the part: check "
            "nx, ny, nz of the faces",
            stacklevel=3,
        )
    return content


def _entity_types(path: Path) -> set[int]:
    """The numbers of the entity types in the directory of an IGES file."""
    try:
        lines = path.read_bytes().splitlines()
    except OSError as error:
        raise InputError(f"cannot be opened: {error.strerror}", path=path) from None
    sections = [line[72:73] for line in lines[:1] + lines[-20:]]
    if sections[:1] in ([b"C"], [b"B"]):
        raise InputError(
            "is a compressed or binary IGES file; export the part as an IGES text file, or as STEP",
            path=path,
        )
    if sections[:1] not in ([b"S"], [b"G"]):
        raise InputError(
            "is not an IGES file: its first line has no S in column 73; export the part as STEP "
            "(AP214 or AP242)",
            path=path,
        )
    if b"T" not in sections:
        raise InputError("is not complete: it has no line with T in column 73", path=path)
    try:
        check_iges_header(lines)
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    directory = [line for line in lines if line[72:73] == b"D"]
    numbers = [re.match(rb"\s*(\d+)", line[:8]) for line in directory[::2]]
    return {int(number.group(1)) for number in numbers if number}
