"""The style that all pictures share. Matplotlib is imported when a picture is drawn."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.base import IntArray, PretravelError, whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

DOTS = 130
"""Of a picture per inch."""
_GAP = 10  # dots on each side of what is drawn, where empty rows are left out
_ENDINGS = (".png", ".svg", ".pdf")
_USUAL_MARGINS = {"rectilinear": (0.6, 0.8, 0.1, 0.3), "polar": (0.3, 0.8, 0.3, 0.6)}
"""What numbers, names, title and legend take around axes: left, below, right, above. [inch]"""
_command = {"runs": False}
"""Whether a command runs: without settings of the folder, and without help for matplotlib."""
_MAKES_HELP = "_update_set_signature_and_docstring"
"""Of matplotlib's artists: makes help for ``set`` of each kind when the kind is made."""


def draw_for_a_command() -> None:
    """Draw without a ``matplotlibrc`` of the current folder: it can start other programs (LaTeX).

    For the command line, which runs next to files of strangers. Half of the time in which
    matplotlib is loaded makes texts of help, which no command shows: they stay empty.
    """
    _command["runs"] = True


def _prepare_for_a_command() -> None:
    import matplotlib as mpl
    from matplotlib import artist

    if not _command["runs"]:
        return
    _command["runs"] = False
    if Path(mpl.matplotlib_fname()).resolve().parent == Path.cwd():
        mpl.rcdefaults()
    kinds = artist.Artist
    makes_help = vars(kinds).get(_MAKES_HELP)
    if makes_help is None:  # another version of matplotlib, which is loaded as it is
        return
    one_help = artist.kwdoc
    setattr(kinds, _MAKES_HELP, classmethod(lambda _: None))
    artist.kwdoc = _no_help
    try:
        import matplotlib.figure
        import matplotlib.projections  # noqa: F401
    finally:
        setattr(kinds, _MAKES_HELP, makes_help)
        artist.kwdoc = one_help


def _no_help(artist: object) -> str:
    del artist
    return ""


def new_figure(
    width: float, height: float, title: str = "", *, interactive: bool = False
) -> Figure:
    """An empty figure of a size in inches, with a title above all of it.

    An interactive one is known to pyplot: notebooks show it below the cell, ``plt.show()`` in a
    window.
    """
    _prepare_for_a_command()
    from matplotlib.figure import Figure

    make = Figure
    if interactive:
        from matplotlib.pyplot import figure as make  # type: ignore[assignment]
    figure = make(figsize=(width, height), layout="constrained", dpi=DOTS)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.set(w_pad=0.15, h_pad=0.12)  # type: ignore[call-arg]
    if title:
        figure.suptitle(title)
    return figure


def drawn_pixels(figure: Figure) -> npt.NDArray[np.uint8]:
    """A figure as an image: (height, width, 4), red, green, blue, opacity.

    ``savefig`` draws twice, first only to place the axes; a single drawing places them too.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    for axes in figure.axes:
        if axes.name in _USUAL_MARGINS and axes.get_label() != "<colorbar>":
            _measure_once(axes)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]


def _measure_once(axes: Axes) -> None:
    """Let the layout, which measures axes, places them, and does both once more, measure them once.

    Its first measure, of axes at places where they do not stay, takes as long as their drawing:
    usual margins lead to almost the same place.
    """
    figure = axes.figure
    margins = figure.dpi * np.array(_USUAL_MARGINS[axes.name]) * (-1.0, -1.0, 1.0, 1.0)

    def usual(*_: Any, **__: Any) -> Bbox:
        del vars(axes)["get_tightbbox"]
        place = axes.get_position(original=True).transformed(figure.transFigure)
        return type(place).from_extents(*(place.extents + margins).tolist())

    axes.get_tightbbox = usual  # type: ignore[method-assign]


def without_gaps(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """An image without empty margins, and with low gaps between what stands above each other."""
    drawn = np.any(pixels != pixels[:1, :1], axis=2)
    near = np.convolve(drawn.any(axis=1), np.ones(2 * _GAP + 1), mode="same") > 0.0
    across = np.flatnonzero(drawn.any(axis=0))
    if len(across) == 0:
        return pixels
    return pixels[near, max(across[0] - _GAP, 0) : across[-1] + _GAP + 1]


def png_content(pixels: npt.NDArray[np.uint8]) -> bytes:
    """The content of a PNG file of `drawn_pixels`."""
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "png", dpi=(DOTS, DOTS))
    return content.getvalue()


def svg_element(figure: Figure) -> str:
    """A figure as one SVG element, which a page can contain: it loads and styles nothing else."""
    import matplotlib as mpl

    content = io.StringIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with mpl.rc_context({"svg.fonttype": "none"}):
        figure.savefig(content, format="svg", metadata=nothing)
    svg = content.getvalue()
    # This rule of matplotlib would hold in all of the page.
    svg, rules = re.subn(r"<style[^>]*>[^<]*</style>", "", svg[svg.index("<svg") :])
    assert rules <= 1
    return svg.replace(
        "<svg", '<svg style="stroke-linejoin:round;stroke-linecap:butt;width:100%;height:auto"', 1
    )


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure, whole or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : str or Path
        Ending in .png, .svg or .pdf.

    Raises
    ------
    PretravelError
        Another ending.
    """
    ending = Path(path).suffix.lower()
    if ending not in _ENDINGS:
        raise PretravelError(
            f"a picture cannot be written to '{path}': the ending must be {', '.join(_ENDINGS)}"
        )
    with whole_file(path) as temporary:
        if ending == ".png":
            temporary.write_bytes(png_content(drawn_pixels(figure)))
        else:
            figure.savefig(temporary)


def some_rows(rows: IntArray, most: int = 5000) -> IntArray:
    """Of very many rows those that a picture draws, evenly spread.

    More marks than that hide each other, and make a file of a picture as large as the data.

    >>> some_rows(np.arange(10), 4).tolist()
    [0, 3, 6, 9]
    """
    if len(rows) <= most:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, most).round().astype(np.int64)])
