"""Reports are tested with their pictures as users see them, but where only their text counts."""

from __future__ import annotations

import pytest

TEXTS = {"test_page.py", "test_subjects.py"}


@pytest.fixture(autouse=True)
def _as_users_see_them(request: pytest.FixtureRequest) -> None:
    """The axes of pictures are placed."""
    if request.path.name not in TEXTS:
        request.getfixturevalue("laid_out_pictures")
