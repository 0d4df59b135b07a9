# Sourced by each script: a temporary folder that goes at the end, and packages of fixed versions in it.
# Exit code of a script: 0: as stated; 1: it behaves otherwise now; 2: it could not be tried here.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 2' INT TERM

# Python packages: packages NAME==VERSION ...
packages() {
    python3 -m venv "$folder/venv" &&
        "$folder/venv/bin/pip" install -q --no-compile --disable-pip-version-check "$@" >"$folder/log" 2>&1 ||
        { cat "$folder/log" >&2; exit 2; }
}

# Python code from stdin; an assertion that fails is exit code 1.
python() { (cd "$folder" && PYTHONPATH="$here" "$folder/venv/bin/python" - "$@"); }

# Packages for Node: modules NAME@VERSION ...
modules() {
    (cd "$folder" && npm init -y && npm install --no-audit --no-fund "$@") >"$folder/log" 2>&1 ||
        { cat "$folder/log" >&2; exit 2; }
}
