"""``python -m pretravel``."""

from pretravel.cli import run

if __name__ == "__main__":  # not in the processes that it starts
    run()
