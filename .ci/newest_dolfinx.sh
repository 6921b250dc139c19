#!/bin/sh
# Runs the finite element and the parallel tests with what pip alone installs, on the newest Python
# of Debian, in a system of its own under build/: no library of finite elements is Debian's. Needs
# root and 4 GB; the second run starts at once.
#
#   sudo .ci/newest_dolfinx.sh                           the tests that need dolfinx or mpirun
#   sudo .ci/newest_dolfinx.sh tests/fe/test_fe_modes.py these tests
#   sudo RELEASE=trixie .ci/newest_dolfinx.sh            with the Python of that release
set -eu
cd "$(dirname "$0")/.."
release="${RELEASE:-testing}"
system="$PWD/build/pip-$release"

[ "$(id -u)" -eq 0 ] || { echo "newest_dolfinx: needs root, try sudo" >&2; exit 1; }
command -v debootstrap >/dev/null || apt-get install -y -qq debootstrap

if [ ! -e "$system/etc/debian_version" ]; then
  mkdir -p "$system"
  debootstrap --variant=minbase --include=ca-certificates "$release" "$system"
fi
for file in /etc/resolv.conf /etc/ssl/certs/ca-certificates.crt /etc/pip.conf; do
  [ ! -e "$file" ] || cp "$file" "$system$file"
done

home="$system/opt/rom"
mkdir -p "$home"
find "$home" -mindepth 1 -maxdepth 1 ! -name '.venv*' -exec rm -rf {} +
git ls-files -co --exclude-standard | tar -cf - -T - | tar -xf - -C "$home"

trap 'umount "$system/proc" "$system/sys" "$system/dev/shm"' EXIT
mount -t proc proc "$system/proc"
mount -t sysfs -o ro sysfs "$system/sys"
mount -t tmpfs tmpfs "$system/dev/shm" # ranks talk through it

if [ $# -eq 0 ]; then
  set -- -m "fenicsx or mpi"
fi
chroot "$system" /usr/bin/env HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  OMP_NUM_THREADS=1 sh -c '
    set -eu
    cd /opt/rom
    # a compiler for forms, and what the wheels of gmsh and VTK take from the system
    packages="python3-venv python3-dev gcc libgl1 libegl1 libxrender1 libglu1-mesa libxcursor1
      libxft2 libxinerama1"
    stamp() { { echo "$packages"; python3 -V; cat pyproject.toml; } 2>/dev/null | sha256sum; }
    if [ "$(cat .venv/.stamp 2>/dev/null)" != "$(stamp)" ]; then
      apt-get update -qq
      DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages \
        >/dev/null
      python3 -m venv --clear .venv
      .venv/bin/python -m pip install -q --disable-pip-version-check -e ".[fe,view,dev]"
      stamp >.venv/.stamp
    fi
    .venv/bin/python -m rom doctor
    echo "$(.venv/bin/python -V) is what is tested here, no other Python from 3.12 on"
    exec .venv/bin/python -m pytest "$@"' sh "$@"
