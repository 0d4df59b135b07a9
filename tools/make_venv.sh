#!/bin/sh
# Creates .venv with pretravel itself, editable, and what it needs without extras, in the locked versions.
set -eu
python="${PYTHON:-python3}"

if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    echo "Python 3.11 or newer is needed; say which: make venv PYTHON=python3.12" >&2
    exit 1
fi
if ! "$python" -m venv .venv >/dev/null 2>&1; then
    # Debian keeps venv in a package of its own.
    rm -rf .venv
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends python3-venv >/dev/null
        "$python" -m venv .venv
    else
        echo "python3 cannot make virtual environments: apt-get install python3-venv" >&2
        exit 1
    fi
fi
echo "installing pretravel into .venv (one to three minutes, without further output)"
.venv/bin/pip install --quiet --disable-pip-version-check --constraint requirements-dev.lock --editable .
