#!/bin/sh
# Sets up a Debian machine: system packages, a virtual environment over them, the package itself,
# a second environment without FEniCSx for the tests of the light half, and for both the compiled
# code that first motions need.
# Safe to run again: what is there is left alone, and then no network is needed.
set -eu
cd "$(dirname "$0")/.."

packages="python3-dolfinx python3-petsc4py python3-slepc4py python3-gmsh python3-meshio
  python3-scipy python3-numba python3-h5py python3-venv python3-dev libopenblas0-pthread
  gcc g++ pkg-config libgl1 libegl1 libxrender1"
# a program that tests compare with, and a browser that opens reports; where they cannot be had,
# those tests are skipped
optional="calculix-ccx chromium"
peer="pyuff==2.5.8" # reads and writes universal files

fail() {
  echo "setup: $1" >&2
  exit 1
}

installed() {
  dpkg-query -W -f='${db:Status-Abbrev}' "$1" 2>/dev/null | grep -q '^ii'
}

command -v dpkg-query >/dev/null || fail "this is no Debian; README.md has lines for conda and Docker"
missing=""
for package in $packages; do
  installed "$package" || missing="$missing $package"
done
if [ -n "$missing" ]; then
  as_root=""
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "no sudo here; as root run: apt-get install$missing"
    as_root="sudo"
  fi
  echo "setup: installing$missing"
  $as_root apt-get update -qq
  # shellcheck disable=SC2086
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    $missing >/dev/null
fi

# A stamp holds the checksum of everything an environment depends on; where it fits, nothing is done.
wanted=$({ pwd; /usr/bin/python3 -V; cat Makefile pyproject.toml constraints.txt .ci/setup.sh \
  .ci/light.txt; } | sha256sum)

try_optional() {
  missing=""
  for package in $optional; do
    installed "$package" || missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  as_root=""
  [ "$(id -u)" -eq 0 ] || as_root="sudo -n"
  # shellcheck disable=SC2086
  { $as_root apt-get update -qq &&
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
      $missing; } >/dev/null 2>&1 || echo "setup: not installed:$missing; some tests are skipped" >&2
}

[ "$(cat .venv/.stamp 2>/dev/null)" = "$wanted" ] || try_optional

# Python compiles what is imported when it is; all that lies there would take as long as to install it
environment() { # folder, options of venv, what pip installs
  [ -x "$1/bin/python" ] && [ "$(cat "$1/.stamp" 2>/dev/null)" = "$wanted" ] && return
  echo "setup: making $1"
  # shellcheck disable=SC2086
  /usr/bin/python3 -m venv $2 "$1"
  folder="$1"
  shift 2
  "$folder/bin/python" -m pip install -q --no-compile --disable-pip-version-check "$@"
  "$folder/bin/python" -m pip install -q --no-compile --disable-pip-version-check --no-deps \
    "$peer" 2>/dev/null || echo "setup: not installed: $peer; a test is skipped" >&2
  echo "$wanted" >"$folder/.stamp"
}

# both at once, as pip uses one core
environment .venv-light "" -r .ci/light.txt &
light=$!
environment .venv --system-site-packages -c constraints.txt -e '.[view,dev,docs]'
wait "$light" || fail "the environment .venv-light could not be made"

# Python runs lines of .pth files when it starts, before OpenBLAS is loaded.
for folder in .venv/lib/python3*/site-packages; do
  env -u OPENBLAS_CORETYPE PYTHONPATH=. /usr/bin/python3 -m rom.doctor.core \
    >"$folder/openblas_core.pth"
done

# Python's own code of the sources, for each process that starts
.venv/bin/python -m compileall -q rom

# What is compiled lies beside the sources, under names with the version of Numba; so does the stamp.
made_of=$({ dpkg-query -W python3-numba; cat .ci/light.txt; echo "${NUMBA_CACHE_DIR:-}"
  find rom -name '*.py' | LC_ALL=C sort | xargs cat; } | sha256sum)

compile_ahead() { # environment
  stamp="rom/__pycache__/$1.compiled"
  [ "$(cat "$stamp" 2>/dev/null)" = "$made_of" ] && return
  echo "setup: compiling what first motions need, for $1"
  mkdir -p rom/__pycache__
  "$1/bin/python" -m rom doctor --compile demo >/dev/null && echo "$made_of" >"$stamp"
}

compile_ahead .venv-light &
light=$!
compile_ahead .venv || fail "kernels could not be compiled for .venv, see above"
wait "$light" || fail "kernels could not be compiled for .venv-light, see above"
