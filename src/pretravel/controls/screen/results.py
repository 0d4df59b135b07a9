"""What comes out for the engineer: verdict, touches in space, errors that corrections leave."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path

from nicegui import ui
from nicegui.events import GenericEventArguments

from pretravel.app import (
    WORKS,
    ScreenPlaces,
    ScreenState,
    ShownResult,
    Work,
    belonging_to,
    document_view,
    empty_state,
    file_drop,
    folded,
    folded_until_opened,
    here,
    kept,
    live,
    no_result,
    note,
    outcome,
    plot,
    result_button,
    result_place,
    same_elsewhere,
    text,
    verdict_card,
    warning,
    work_status,
)
from pretravel.controls.screen.inputs import answer_about_file
from pretravel.controls.screen.settings import tasks_of
from pretravel.controls.screen.touches import touches_table
from pretravel.controls.screen.work import (
    EXPORT,
    FIT,
    LOOK,
    PART,
    ExportResult,
    FitResult,
    LookResult,
    TouchesPicture,
)
from pretravel.show import Chart, PolarChart, SpaceChart, plotly_figure
from pretravel.tasks.compensate import CompensatedTouches

_EMPTY = "Your touches on the reference, as soon as their file is dropped"
_LONGEST_TEXT = 20_000
_MOST_OUTLIERS = 5
"""That are described one by one; the report has all."""


def results(state: ScreenState, places: ScreenPlaces) -> None:
    """The picture and the tabs."""
    fit, export = WORKS.of(state, FIT), WORKS.of(state, EXPORT)
    with places.status:
        work_status(state, FIT, answer=partial(answer_about_file, state))
    with places.answer:
        result_place(fit, _verdict)
    with places.picture, ui.element("div").classes("charts"):
        _touches_in_space(state)
        result_place(fit, lambda result: _plots(_lobe_charts(result)[:1]), says_warnings=False)
    with places.tab("Touches"), belonging_to(WORKS.of(state, LOOK), fit):
        touches_table(state)
    with places.tab("Lobes"):
        result_place(fit, _lobes, empty=no_result, says_warnings=False)
    with places.tab("Corrections"):
        result_place(fit, _corrections, empty=no_result, says_warnings=False)
    with places.tab("Files"):
        with belonging_to(export):
            live([export.listen], lambda: _control_files(export.result), lambda: export.result)
        live([fit.listen], lambda: _part(state), lambda: fit.result is None)
        with belonging_to(fit, export):
            live([fit.listen, export.listen], lambda: _same(state),
                 lambda: (fit.result, export.result))  # fmt: skip


def _verdict(result: FitResult) -> None:
    report, compared = result.report, result.compared
    with ui.element("article").classes("document"):
        if compared is None:
            verdict_card(f"{report.verdict}.", report.judgement)
        else:
            verdict_card(
                f"{compared.sentence()}.", report.judgement, figures=compared.headline(),
                prose=(f"{report.verdict}.",),
            )  # fmt: skip
        for outlier in result.qualified.qualification.outliers[:_MOST_OUTLIERS]:
            warning(f"Outlier: {outlier.message}. {outlier.outcome}.")
        if result.problem:
            note(f"Corrections of controls cannot be compared: {result.problem}")
        for words in report.warnings:
            warning(words[0].upper() + words[1:])


def _touches_in_space(state: ScreenState) -> None:
    """The picture stays in place while touches are ticked; only its content changes."""
    look, fit = WORKS.of(state, LOOK), WORKS.of(state, FIT)

    def there() -> bool:
        return _shown(look.result, fit.result) is not None

    def build() -> None:
        if there():
            _picture(state)
        else:
            empty_state("radar", _EMPTY)

    with belonging_to(look, fit):
        live([look.listen, fit.listen], build, there)


def _shown(look: LookResult | None, fit: FitResult | None) -> TouchesPicture | None:
    """The newest picture of the touches."""
    if fit is not None:
        return fit.picture
    return None if look is None else look.picture


def _picture(state: ScreenState) -> None:
    look, fit = WORKS.of(state, LOOK), WORKS.of(state, FIT)
    first = _shown(look.result, fit.result)
    assert first is not None
    drawn = [first]
    picture = plot(first.figure, "Touches on the reference in space, colours: residuals")

    def refresh() -> None:
        now = _shown(look.result, fit.result)
        if now is not None and now is not drawn[0]:
            drawn[0] = now
            picture.update_figure(now.figure)

    def clicked(event: GenericEventArguments) -> None:
        if fit.result is not None:
            point = event.args["points"][0]
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
    from pretravel.controls.screen.touches import set_used

    rows = result.touches.rows()
    of_points = trace - 2  # a surface and the bars come first
    if 0 <= of_points < len(rows) and 0 <= point < len(rows[of_points]):
        row = int(rows[of_points][point])
        set_used(state, result.names[row], used=bool(result.touches.left_out[row]))


def _lobe_charts(result: FitResult) -> list[Chart]:
    charts = result.report.pictures[0].charts
    shown = [chart for chart in charts if isinstance(chart, PolarChart | SpaceChart)]
    return [chart for chart in shown if chart.title.startswith("pretravel")]


def _plots(charts: Iterable[Chart]) -> None:
    for chart in charts:
        plot(plotly_figure(chart), chart.title)


def _lobes(result: FitResult) -> None:
    with ui.element("div").classes("charts"):
        _plots(_lobe_charts(result)[1:])
    folded_until_opened("Full report of the qualification", lambda: document_view(result.report))


def _corrections(result: FitResult) -> None:
    """What simpler corrections leave."""
    costs = result.costs
    if costs is None:
        note(f"Corrections of controls cannot be compared: {result.problem}")
        return
    for chart in costs.pictures[0].charts[1:2]:
        plot(plotly_figure(chart), chart.title)
    folded_until_opened(
        "All corrections, over the azimuth and in a table", lambda: document_view(costs)
    )


def _control_files(result: ExportResult | None) -> None:
    if result is None:
        note("The files for your control appear here when it is chosen in step 3.")
        return
    head = [words for words in result.files.remarks if words.startswith(("(", ";"))]
    for words in result.files.remarks:
        if words not in head:
            text("p", words)
    if head:
        text("pre", "\n".join(head), "file-text").props('tabindex="0"')
    for name, content in result.files.texts.items():
        folded_until_opened(name or "Text of the file", partial(_file_text, content))


def _file_text(content: str) -> None:
    shown = content[:_LONGEST_TEXT]
    text("pre", shown, "file-text").props('tabindex="0"')
    if len(shown) < len(content):
        note(f"The first {len(shown)} of {len(content)} characters.")


def _part(state: ScreenState) -> None:
    if WORKS.of(state, FIT).result is None:
        return
    with folded("Try the map on a part", opened=bool(state.files["part"])):
        file_drop(state, "part", "Touches on a part, to compensate with this map")
        work = outcome(state, PART, lambda made: document_view(made.document))
        kept(work, lambda: _points_to_keep(work))


def _points_to_keep(work: Work[ShownResult[CompensatedTouches]]) -> None:
    def write(path: Path, result: ShownResult[CompensatedTouches]) -> None:
        result.made.write("output", path)

    result_button(work, "Surface points", "points.csv", write)


def _same(state: ScreenState) -> None:
    fit, export = WORKS.of(state, FIT).result, WORKS.of(state, EXPORT).result
    if fit is not None:
        settings = fit.settings if export is None else export.settings
        same_elsewhere(*tasks_of(fit.name, settings))
