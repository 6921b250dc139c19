#!/bin/sh
# Runs tests with another Python and dolfinx than those of Debian 12, in a Debian of its own under
# build/. The way in is one of docs/install.md: "debian", packages of the release, or "pip", where no
# library of finite elements is Debian's. Needs root and 4 GB; the second run starts at once.
#
#   sudo .ci/other_systems.sh debian trixie   the tests that need dolfinx or mpirun
#   sudo .ci/other_systems.sh pip testing     the same, on the newest Python of Debian
#   sudo .ci/other_systems.sh pip trixie tests/fe/test_fe_modes.py   these tests
#   sudo .ci/other_systems.sh walks trixie    what newcomers type, timed, see .ci/walks.py
set -eu

fail() {
  echo "other_systems: $1" >&2
  exit 1
}

way="${1:-}"
release="${2:-}"
case "$way" in
  debian | pip | walks) ;;
  *) fail "the way in is debian, pip or walks, not '$way'" ;;
esac
[ -n "$release" ] || fail "which release of Debian?"
[ "$(id -u)" -eq 0 ] || fail "needs root, try sudo"
# what is mounted below is seen by this script alone and ends with it
[ -n "${APART:-}" ] || APART=1 exec unshare --mount "$0" "$@"
shift 2
[ $# -gt 0 ] || set -- -m "fenicsx or mpi"

cd "$(dirname "$0")/.."
system="$PWD/build/$way-$release"
if [ ! -e "$system/.complete" ]; then
  command -v debootstrap >/dev/null || apt-get install -y -qq debootstrap
  rm -rf "$system"
  mkdir -p "$system"
  debootstrap --variant=minbase --include=ca-certificates "$release" "$system"
  touch "$system/.complete"
fi
for file in /etc/resolv.conf /etc/ssl/certs/ca-certificates.crt /etc/pip.conf; do
  [ ! -e "$file" ] || cp "$file" "$system$file"
done

home="$system/opt/rom"
mkdir -p "$home"
find "$home" -mindepth 1 -maxdepth 1 ! -name '.venv*' -exec rm -rf {} +
git ls-files -co --exclude-standard | tar -cf - -T - | tar -xf - -C "$home"

mount -t proc proc "$system/proc"
mount -t sysfs -o ro sysfs "$system/sys"
mount -t devpts devpts "$system/dev/pts"
mount -t tmpfs tmpfs "$system/dev/shm" # ranks talk through it

chroot "$system" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin OMP_NUM_THREADS=1 \
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 sh -c '
    set -eu
    cd /opt/rom
    way="$1"
    shift
    # a compiler for forms, and what the wheels of gmsh and VTK take from the system
    packages="python3-venv python3-dev gcc libgl1 libegl1 libxrender1 libglu1-mesa libxcursor1
      libxft2 libxinerama1"
    stamp() { { echo "$packages"; python3 -V; cat pyproject.toml; } 2>/dev/null | sha256sum; }
    install() {
      # a mirror of testing may be some weeks behind
      apt-get -o Acquire::Check-Valid-Until=false update -qq
      DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages \
        >/dev/null
    }
    if [ "$way" = debian ]; then
      .ci/setup.sh
    elif [ "$way" = walks ]; then
      install
      exec python3 .ci/walks.py
    elif [ "$(cat .venv/.stamp 2>/dev/null)" != "$(stamp)" ]; then
      install
      python3 -m venv --clear .venv
      .venv/bin/python -m pip install -q --disable-pip-version-check -e ".[fe,view,dev]"
      stamp >.venv/.stamp
    fi
    .venv/bin/python -m rom doctor
    exec .venv/bin/python -m pytest "$@"' sh "$way" "$@"
