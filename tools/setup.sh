#!/bin/sh
# Sets up what `make demo` and `make test` need: ngspice from the system's packages, a virtual
# environment, this package with the versions of its dependencies in constraints.txt.  What is there already is left alone.
set -eu
python=${PYTHON:-python3}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "setup: python3 must be 3.11 or newer, but is $("$python" --version 2>&1)" >&2
    exit 2
}

# System packages, where there is apt and root; what cannot be had so comes from the package index below.
root=""
[ "$(id -u)" = 0 ] || root="sudo -n"
can_install=""
if command -v apt-get >/dev/null && { [ -z "$root" ] || { [ -t 0 ] && command -v sudo >/dev/null && root="sudo"; } ||
    sudo -n true 2>/dev/null; }; then can_install=yes; fi

library=yes
"$python" -c 'import ctypes.util, sys; sys.exit(ctypes.util.find_library("ngspice") is None)' || library=""
[ -z "${NGSPICE_LIBRARY_PATH:-}" ] || library=yes

missing=""
[ -n "$library" ] || missing="libngspice0"
command -v ngspice >/dev/null || missing="$missing ngspice"
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing="$missing python3-venv"

if [ -n "$missing" ] && [ -n "$can_install" ]; then
    echo "setup: installing through apt-get${root:+ (with sudo)}: $missing"
    $root apt-get update -qq
    # shellcheck disable=SC2086 # a list of packages
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
    library=yes
elif "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    :
else
    echo "setup: python3 must have its module venv (python3-venv), but has not, and there is no apt-get or no root to get it" >&2
    exit 2
fi

# The tests look at the page of `harvester explore` in a real browser; nothing else needs it. It comes while pip works,
# but for where sudo may ask for a password.
browser() {
    echo "setup: installing through apt-get${root:+ (with sudo)}, for the tests only: chromium"
    $root apt-get update -qq
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null ||
        echo "setup: chromium was not installed, so the tests of the page in a browser will fail; all else works" >&2
}
if ! command -v chromium >/dev/null && ! command -v chromium-browser >/dev/null && [ -n "$can_install" ]; then
    if [ "$root" = sudo ]; then browser; else browser & fi
fi

echo "setup: installing this package into .venv, with the versions of constraints.txt"
[ -x .venv/bin/python ] || "$python" -m venv .venv
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint constraints.txt --editable '.[test]'
# Without the system's ngspice, that of a wheel: one that lies here, the index's, or one that is built here.
if [ -z "$library" ] && ! .venv/bin/python -c 'import piezo_harvester_ngspice as n; n.library()' 2>/dev/null; then
    echo "setup: there is no libngspice, and no apt-get or no root to get it: installing piezo-harvester-ngspice into .venv"
    pip() { .venv/bin/python -m pip install --quiet --disable-pip-version-check "$@"; }
    pip --no-index --find-links packaging/ngspice/dist piezo-harvester-ngspice 2>/dev/null ||
        pip --only-binary :all: piezo-harvester-ngspice 2>/dev/null ||
        { echo "setup: there is no such wheel: building it from the source of ngspice, which takes some minutes" && pip ./packaging/ngspice; } || {
        echo "setup: libngspice is missing, and no way to get it worked: see packaging/ngspice/README.md" >&2
        exit 2
    }
fi

# Bytecode on all cores, which pip would make on one, of this package and of what may be imported here: not of tests, nor
# of large parts of packages that nothing here uses. What does not compile is a template, or for another Python: pip
# leaves it as well.
unused='/(tests?|testsuite|benchmarks|_vendored|mypyc?|cuda|jedi|lexers|distutils|pip|setuptools|debugpy|sympy/physics|sympy/stats|dask/array|dask/dataframe|pydantic/v1|playwright/async_api|SALib/sample/.*)/'
.venv/bin/python -W ignore -m compileall -qq -j 0 -x "$unused" .venv/lib harvester || true
wait # for the browser
