"""Settings that single kinds of map have: fields of these kinds, as people type them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import ANGLE
from pretravel.task import Field, Task, When, by_name

if TYPE_CHECKING:
    from pretravel.maps import KindOfMap

_WITHOUT_KIND = ("prior", "block", "reference")


def kinds_where(holds: Callable[[KindOfMap], bool]) -> When:
    """The kinds of map with a property, and the choice among them."""

    def names() -> list[str]:
        from pretravel.maps import AUTO, KINDS

        return [*(name for name, kind in KINDS.usable().items() if holds(kind)), AUTO]

    return When("kind", names)


def _with_field(name: str) -> tuple[When, ...]:
    return (kinds_where(lambda kind: hasattr(kind, name)),)


class SettingsOfKinds(Task):
    """A field here is one of the kinds that have a field of this name."""

    lobe_azimuth_deg: Annotated[
        float | None,
        Field(
            help="Azimuth of the largest pretravel, opposite a rod, in degrees; the default is "
            "determined from 8 directions or more.",
            range=ANGLE,
            label="Azimuth of the largest pretravel",
            hint="Empty: determined from the touches",
            only=_with_field("lobe_azimuth"),
            without=(*_WITHOUT_KIND, When("transducer", ("piezo",))),
        ),
    ] = None
    transducer: Annotated[
        Literal["contact", "piezo"],
        Field(
            help="contact (the map has lobes) or piezo (it has none).",
            words={"contact": "Contacts (the map has lobes)", "piezo": "Piezo (no lobes)"},
            only=_with_field("transducer"),
            without=_WITHOUT_KIND,
        ),
    ] = "contact"

    def kind_of_map(self, name: str) -> KindOfMap:
        """A kind with the settings that are its own.

        >>> from pretravel.tasks.qualify import Qualify
        >>> task = Qualify(touches="t.csv", diameter=25, kind="wozniak", transducer="piezo")
        >>> task.kind_of_map("wozniak").transducer, task.kind_of_map("mean").name
        ('piezo', 'mean')
        """
        from pretravel.maps import KINDS, kind_named

        described = by_name(SettingsOfKinds).values()
        given = {each.plain_name: each.inside(getattr(self, each.name)) for each in described}
        own = {key: value for key, value in given.items() if hasattr(KINDS[name], key)}
        return kind_named(name, **own)
