#!/bin/sh
# Sets up what `make demo` and `make test` need: ngspice from the system's packages, a virtual
# environment, this package with the versions of its dependencies in lock.txt.  What is there already is left alone.
set -eu
python=${PYTHON:-python3}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "setup: python3 must be 3.11 or newer, but is $("$python" --version 2>&1)" >&2
    exit 2
}

missing=""
"$python" -c 'import ctypes.util, sys; sys.exit(ctypes.util.find_library("ngspice") is None)' || missing="libngspice0"
command -v ngspice >/dev/null || missing="$missing ngspice"
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing="$missing python3-venv"

if [ -n "$missing" ]; then
    root=""
    [ "$(id -u)" = 0 ] || root="sudo"
    command -v apt-get >/dev/null || {
        echo "setup: these must be installed, but there is no apt-get to do it: $missing" >&2
        exit 2
    }
    echo "setup: installing through apt-get${root:+ (with sudo)}: $missing"
    $root apt-get update -qq
    # shellcheck disable=SC2086 # a list of packages
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
fi

# The tests look at the page of `harvester explore` in a real browser; nothing else needs it.
if ! command -v chromium >/dev/null && ! command -v chromium-browser >/dev/null && command -v apt-get >/dev/null; then
    root=""
    [ "$(id -u)" = 0 ] || root="sudo"
    echo "setup: installing through apt-get${root:+ (with sudo)}, for make test only: chromium"
    $root apt-get update -qq
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null ||
        echo "setup: chromium was not installed, so the tests of the page in a browser will fail; all else works" >&2
fi

echo "setup: installing this package into .venv, with the versions of lock.txt"
[ -x .venv/bin/python ] || "$python" -m venv .venv
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint lock.txt --editable '.[test]'
# Bytecode on all cores, and without the tests that other packages bring: pip takes one core, and compiles those too.
# What does not compile is a template, or for another Python: nobody imports it, and pip leaves it as well.
.venv/bin/python -W ignore -m compileall -qq -j 0 -x '/tests/' .venv/lib || true
