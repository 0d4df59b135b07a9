"""The tables of a laboratory's file of which every report says whether they are stated."""

from __future__ import annotations

REPORT_TABLES = ("laboratory", "instrument", "reference", "conditions", "measurement")
"""Tables of the file that every report but a certificate states, in its order."""
