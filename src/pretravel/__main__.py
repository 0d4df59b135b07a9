"""``python -m pretravel``."""

from pretravel.cli.main import run

run()
