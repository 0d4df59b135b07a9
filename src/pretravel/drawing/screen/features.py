"""Features of a part: chosen by the labels of the points, measured, a row for each quantity."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from nicegui import ui

from pretravel.app import (
    WORKS,
    ScreenState,
    ShownResult,
    Work,
    described_fields,
    document_view,
    file_drop,
    folded,
    folded_until_opened,
    here,
    kept,
    live,
    note,
    outcome,
    page_button,
    result_button,
    section_view,
    sign_and_word,
    text,
    verdict_card,
    warning,
)
from pretravel.base import MICROMETRE
from pretravel.drawing.screen.tolerance_table import in_one_line, rows_in, tolerance_table
from pretravel.drawing.screen.work import (
    FEATURE_FORM,
    FEATURES,
    PartResult,
    groups_of,
)
from pretravel.drawing.tasks.measure.lines import ToleranceLine
from pretravel.drawing.tasks.measure.report import FeatureRow, feature_rows, short_report
from pretravel.drawing.tasks.measure.settings_of_features import BY_LABEL
from pretravel.drawing.tasks.measure.task import MeasuredFeatures
from pretravel.measurement import named_feature
from pretravel.show import Judgement, decimals, number_text

_USUAL = ("feature", "size_tolerance", "form_tolerance", "u_machine_um")
_OF_TABLE = ("u_machine_um", "probability")
"""What counts where the table states the tolerances."""
_MORE = tuple(name for name in FEATURE_FORM.names if name not in _USUAL)
_FEATURE, _SELECT, _EACH = map(FEATURE_FORM.stored_name, ("feature", "select", "by_prefix"))


def features_depend_on(result: PartResult) -> object:
    """What makes other fields of the tab: else they stay while the points are computed again."""
    return result.compensated.points.labels, result.part is None, result.face is None


def features_tab(state: ScreenState, points: Work[PartResult]) -> None:
    """What is measured, the button, and the rows of results."""
    labels = points.result.compensated.points.labels
    groups = groups_of(labels)

    def by_label_at_first() -> None:
        if _FEATURE not in state.settings and any(map(named_feature, groups)):
            state.settings[_FEATURE] = BY_LABEL

    by_label_at_first()
    here([state.listen], by_label_at_first)
    file_drop(
        state, "drawing", "The drawing (if the model has no tolerances)",
        endings=(".toml", ".qif", ".dmi"),
        hint="Its tolerances (.toml, as the task Drawing writes it), or a plan (.qif, .dmi)",
    )  # fmt: skip
    tolerance_table(state, points, lambda: WORKS.of(state, FEATURES))

    def fields() -> None:
        if rows_in(state):
            with ui.element("div").classes("field-grid"):
                described_fields(state, FEATURE_FORM, _OF_TABLE)
            return
        if groups and not state.files["drawing"]:
            _chips(state, groups)
        with ui.element("div").classes("field-grid"):
            described_fields(state, FEATURE_FORM, _USUAL)
        with folded("More settings"):
            described_fields(state, FEATURE_FORM, _MORE)
            note(f"Labels of the points: {', '.join(labels[:8])} …")

    live([state.listen], fields, lambda: (bool(rows_in(state)), state.files["drawing"]))
    built: list[bool] = []

    def show(result: ShownResult[MeasuredFeatures]) -> None:
        rows = _shown(result)
        if built:  # the rows stand below the fields that a person has just filled in
            ui.run_javascript(_TO_ROWS.replace("ROWS", str(rows.id)))

    work = outcome(state, FEATURES, show, button="Measure")
    built.append(True)
    kept(work, lambda: _to_keep(work))
    live([work.listen], lambda: _same(work.result), lambda: work.result)


def _chosen(state: ScreenState, groups: dict[str, tuple[int, str]]) -> tuple[str, ...]:
    """The groups that are measured."""
    patterns = str(state.settings.get(_SELECT) or "").split()
    if patterns:
        return tuple(name for name, (_, pattern) in groups.items() if pattern in patterns)
    if state.settings.get(_FEATURE) == BY_LABEL:
        return tuple(filter(named_feature, groups))
    return tuple(groups) if state.settings.get(_EACH) else ()


def _chips(state: ScreenState, groups: dict[str, tuple[int, str]]) -> None:
    """A button for each group; they stay while they are pressed one after the other."""

    def toggle(name: str) -> None:
        chosen = _chosen(state, groups)
        now = [one for one in groups if (one in chosen) != (one == name)]
        state.settings[_EACH] = bool(now)
        state.settings[_SELECT] = " ".join(groups[one][1] for one in now)

    chips = {}
    with ui.element("div").classes("chips").props('role="group" aria-label="What is measured"'):
        for name, (count, _) in groups.items():
            chips[name] = ui.button(f"{name} · {count}", on_click=partial(toggle, name))
            chips[name].props("no-caps outline").classes("chip")

    def show() -> None:
        chosen = _chosen(state, groups)
        for name, chip in chips.items():
            chip.props["aria-pressed"] = "true" if name in chosen else "false"

    show()
    here([state.listen], show)


def features_verdict(result: ShownResult[MeasuredFeatures]) -> None:
    """The verdict, which stands above all tabs.

    Parameters
    ----------
    result : ShownResult of MeasuredFeatures
    """
    verdict_card(result.document.verdict, result.document.judgement)


def _shown(result: ShownResult[MeasuredFeatures]) -> ui.element:
    document = result.document
    for words in document.warnings:
        warning(words)
    lines = result.made.lines
    rows = _main_rows(feature_rows(result.made.features, result.made.relations))
    with ui.element("div").classes("table-frame").props('tabindex="0" role="region"') as frame:
        frame.props["aria-label"] = "Tolerances" if lines else "Features"
        with ui.element("table").classes("sortable feature-rows"):
            headings = _OF_LINES if lines else _OF_ROWS
            with ui.element("thead"), ui.element("tr"):
                for heading in headings:
                    number = "number" if heading in _NUMBERS else ""
                    text("th", heading, number).props('scope="col"')
            with ui.element("tbody"):
                for line in lines:
                    _line(line)
                for row in [] if lines else rows:
                    _row(row)
    for section in document.sections:
        folded_until_opened(section.heading, partial(section_view, section))
    folded_until_opened("Full report", lambda: document_view(document))
    return frame


_TO_ROWS = """
const rows = getHtmlElement(ROWS), panels = rows.closest('.q-tab-panels');
const below = rows.getBoundingClientRect().top - panels.getBoundingClientRect().top;
if (panels.scrollHeight > panels.clientHeight)
  panels.scrollTo({top: panels.scrollTop + below - 8, behavior: 'smooth'});
else rows.scrollIntoView({block: 'nearest', behavior: 'smooth'});
"""
"""Shows the first row, which fails, without moving the verdict and the picture away."""
_OF_LINES = ("feature", "characteristic", "limits", "value", "U", "k", "verdict")
_OF_ROWS = ("feature", "", "before/mm", "after/mm", "U/µm")
"""Without a tolerance: each tolerance has a line."""
_NUMBERS = ("value", "U", "k", "before/mm", "after/mm", "U/µm")


def _line(line: ToleranceLine) -> None:
    """One tolerance: what fails stands first, in colour and in words."""
    with ui.element("tr"):
        text("th", line.feature).props('scope="row"')
        text("td", line.named).props('data-label="characteristic"')
        with ui.element("td"):
            text("span", line.limits)
            if math.isfinite(line.value):
                _bar((line.lower, line.upper), line.value, line.expanded_u)
        for heading, words in (
            ("value", line.value_text), ("U", line.u_text), ("k", line.k_text),
        ):  # fmt: skip
            text("td", in_one_line(words), "number").props(f'data-label="{heading}"')
        cell = ui.element("td").classes("row-verdict")
        with cell, ui.element("span").classes(f"row-judgement {line.level}"):
            sign_and_word(Judgement(line.level, line.words), "span")


def _main_rows(rows: list[FeatureRow]) -> list[FeatureRow]:
    """A row for each feature: its first quantity."""
    first = {row.name: row for row in reversed(rows)}
    return [row for row in rows if row is first[row.name]]


def _row(row: FeatureRow) -> None:
    quantity = row.quantity
    before, after = quantity.uncompensated, quantity.value
    with ui.element("tr"):
        text("th", row.name).props('scope="row"')
        text("td", quantity.name)
        text("td", "" if before is None else number_text(before, decimals(4)), "number").props(
            'data-label="before/mm"'
        )
        text("td", number_text(after, decimals(4)), "number").props('data-label="after/mm"')
        known = math.isfinite(quantity.expanded_u)
        expanded = number_text(quantity.expanded_u / MICROMETRE) if known else ""
        text("td", expanded, "number").props('data-label="U/µm"')


def _bar(limits: tuple[float, float], here: float, expanded_u: float) -> None:
    """The tolerance as a zone, the value as a dot with its U."""
    lower, upper = limits
    ends = [end for end in (lower, upper) if math.isfinite(end)]
    values = [here - expanded_u, here + expanded_u]
    values = [value for value in values if math.isfinite(value)] or [here]
    width = max(ends[-1] - ends[0], *(abs(value - end) for value in values for end in ends))
    low, high = min(ends) - 0.5 * width, max(ends) + 0.5 * width

    def place(value: float) -> float:
        """In percent of the bar; what is outside stands at its end."""
        return 100.0 * min(max((value - low) / (high - low), 0.0), 1.0)

    words = (
        f"{here:.4f} mm, tolerance {_limit(lower)} to {_limit(upper)} mm, "
        f"U {expanded_u / MICROMETRE:.2f} µm"
    )
    with ui.element("div").classes("tolerance-bar").props('role="img"') as bar:
        bar.props["aria-label"] = bar.props["title"] = words
        left, right = place(lower), place(upper)
        ui.element("span").classes("zone").style(f"left: {left:.2f}%; width: {right - left:.2f}%")
        start, end = place(values[0]), place(values[-1])
        ui.element("span").classes("whisker").style(
            f"left: {start:.2f}%; width: {end - start:.2f}%"
        )
        ui.element("span").classes("after").style(f"left: {place(here):.2f}%")


def _limit(value: float) -> str:
    return f"{value:.4f}" if math.isfinite(value) else "any"


def _to_keep(work: Work[ShownResult[MeasuredFeatures]]) -> None:
    def write(path: Path, result: ShownResult[MeasuredFeatures]) -> None:
        result.made.write("output", path)

    with ui.element("div").classes("buttons"):
        result_button(work, "features.csv", "features.csv", write)
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="features.html",
        )  # fmt: skip
        page_button(
            work, lambda result: short_report(result.document), lambda result: result.command,
            name="tolerances.pdf", label="PDF of one or two pages",
        )  # fmt: skip


def _same(result: ShownResult[MeasuredFeatures] | None) -> None:
    if result is not None:
        note(result.command)
