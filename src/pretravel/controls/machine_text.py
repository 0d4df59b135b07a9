"""The machine file as a text to be edited."""

from __future__ import annotations

from pretravel.base import DEGREE, Placement
from pretravel.controls.gcode import render
from pretravel.files import Machine, work_turn


def machine_text(machine: Machine) -> str:
    """A machine file, to be edited.

    >>> machine_text(Machine()).splitlines()[3]
    'name = "machine"'
    """
    work = machine.work or Placement()
    return render("machine.toml", machine=machine, work=work, rotation_deg=work_turn(work) / DEGREE)
