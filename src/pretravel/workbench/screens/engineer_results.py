"""What comes out for the engineer: verdict, touches in space, errors that corrections leave."""

from __future__ import annotations

from typing import Any

from pretravel.report.chart_plotly import plotly_figure
from pretravel.report.touch_sphere_chart import touches_chart
from pretravel.workbench.components.document_view import document_view
from pretravel.workbench.components.downloads import download_button
from pretravel.workbench.components.file_drop import file_drop
from pretravel.workbench.components.layout import folded, here, live, note, panel, text, warning
from pretravel.workbench.components.outcome import outcome
from pretravel.workbench.components.plot import ColouredPlot, plot
from pretravel.workbench.components.same_elsewhere import same_elsewhere
from pretravel.workbench.project import ScreenState
from pretravel.workbench.screens.engineer_settings import command_lines, python_lines
from pretravel.workbench.screens.engineer_touches import touches_table
from pretravel.workbench.screens.engineer_work import (
    EXPORT,
    FIT,
    LOOK,
    PART,
    ExportResult,
    FitResult,
    LookResult,
    TriedMap,
)
from pretravel.workbench.tasks import WORKS

_MISSING = "Here you see your touches on the sphere, a verdict on the probe, and what it costs."
_LONGEST_TEXT = 20_000


def results(state: ScreenState) -> None:
    """Everything on the right."""
    outcome(state, FIT, lambda result: _verdict(result), missing=_MISSING)
    _touches_in_space(state)
    fit, export = WORKS.of(state, FIT), WORKS.of(state, EXPORT)
    live([fit.listen], lambda: _costs(fit.result), lambda: fit.result)
    live([export.listen], lambda: _control_files(export.result), lambda: export.result)
    live([fit.listen], lambda: _part(state), lambda: fit.result is None)
    live([fit.listen, export.listen], lambda: _same(state), lambda: (fit.result, export.result))


def _verdict(result: FitResult | None) -> None:
    if result is None:
        return
    report = result.document()
    with panel("Verdict"):
        sentence = result.compared.sentence() if result.compared is not None else ""
        text("p", f"{sentence}." if sentence else f"{report.verdict}.", "verdict")
        if sentence:
            text("p", f"{report.verdict}.")
        if result.problem:
            note(f"Corrections of controls cannot be compared: {result.problem}")
        for words in report.warnings:
            warning(words)


def _touches_in_space(state: ScreenState) -> None:
    """The picture stays in place while touches are ticked; only its content changes."""
    look, fit = WORKS.of(state, LOOK), WORKS.of(state, FIT)

    def there() -> bool:
        return _shown(look.result, fit.result) is not None

    def build() -> None:
        if there():
            with panel("Touches"):
                _picture(state)
                touches_table(state)

    live([look.listen, fit.listen], build, there)


def _shown(
    look: LookResult | None, fit: FitResult | None
) -> tuple[dict[str, Any], str, object] | None:
    """Figure, note and touches of the newest result that is there."""
    if fit is not None:
        chart = touches_chart(fit.touches)
        return plotly_figure(chart), chart.note, fit.touches
    if look is not None and look.found is not None and look.touches is not None:
        title = "Touches on the sphere that fits them best"
        unit = "mm" if look.found.unit_known else "unit of the file"
        chart = touches_chart(look.touches, title, unit=unit)
        return plotly_figure(chart), chart.note, look.touches
    return None


def _picture(state: ScreenState) -> None:
    look, fit = WORKS.of(state, LOOK), WORKS.of(state, FIT)
    first = _shown(look.result, fit.result)
    assert first is not None
    drawn = [first[2]]
    picture: ColouredPlot = plot(first[0], "Touches on the reference in space, colours: residuals")
    remark = text("p", first[1], "note")

    def refresh() -> None:
        now = _shown(look.result, fit.result)
        if now is not None and now[2] is not drawn[0]:
            drawn[0] = now[2]
            picture.update_figure(now[0])
            remark.set_text(now[1])

    def clicked(event: object) -> None:
        if fit.result is None:
            return
        point = event.args["points"][0]  # type: ignore[attr-defined]
        toggle_point(state, fit.result, point["curveNumber"], point["pointNumber"])

    here([look.listen, fit.listen], refresh)
    picture.on("plotly_click", clicked)


def toggle_point(state: ScreenState, result: FitResult, trace: int, point: int) -> None:
    """Leave out the touch that was clicked, or use it again.

    Parameters
    ----------
    state : ScreenState
    result : FitResult
    trace, point : int
        The last three traces of the picture are the rows of `TouchesInSpace.rows`.
    """
    from pretravel.workbench.screens.engineer_touches import set_used

    rows = result.touches.rows()
    of_points = trace - 2  # a surface and the bars come first
    if 0 <= of_points < len(rows) and 0 <= point < len(rows[of_points]):
        row = int(rows[of_points][point])
        set_used(state, result.names[row], used=bool(result.touches.left_out[row]))


def _costs(result: FitResult | None) -> None:
    if result is None:
        return
    if result.compared is not None:
        with panel("What a simpler correction leaves"):
            report = result.compared.document()
            document_view(report)
    with folded("Full report of the qualification"):
        document_view(result.document())


def _control_files(result: ExportResult | None) -> None:
    if result is None:
        return
    with panel("Files for the control"):
        for words in result.files.remarks:
            note(words)
        for name, content in result.files.texts.items():
            with folded(name or "Text of the file", opened=len(result.files.texts) == 1):
                shown = content[:_LONGEST_TEXT]
                text("pre", shown, "file-text").props('tabindex="0"')


def _part(state: ScreenState) -> None:
    if WORKS.of(state, FIT).result is None:
        return
    with folded("Try the map on a part", opened=bool(state.files["part"])):
        file_drop(state, "part", "Touches on a part, to compensate with this map")
        outcome(state, PART, _show_part)


def _show_part(result: TriedMap | None) -> None:
    if result is None:
        return
    document_view(result.compensated.document(result.name))
    download_button("Surface points", "points.csv", result.write)


def _same(state: ScreenState) -> None:
    fit, export = WORKS.of(state, FIT).result, WORKS.of(state, EXPORT).result
    if fit is not None:
        settings = fit.settings if export is None else export.settings
        same_elsewhere(command_lines(fit.name, settings), python_lines(fit.name, settings))
