"""Settings of Hypothesis, and fixtures that the tests share."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe

# Derandomised: a check that passes here passes on every machine.
settings.register_profile(
    "pretravel",
    derandomize=True,
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
settings.load_profile("pretravel")


@pytest.fixture
def omp40() -> Probe:
    return load_probe("omp40-2")
