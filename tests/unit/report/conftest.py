"""Reports are tested with their pictures as users see them."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _as_users_see_them(laid_out_pictures: None) -> None:
    """The axes of pictures are placed."""
