#!/bin/sh
# Runs the finite element tests with a newer dolfinx: that of Debian 13, in a system of its own
# under build/. Needs root and 4 GB; the second run starts at once.
#
#   sudo .ci/newer_dolfinx.sh                         the tests that need dolfinx
#   sudo .ci/newer_dolfinx.sh tests/fe/test_fe_modes.py  these tests
set -eu
cd "$(dirname "$0")/.."
system="$PWD/build/debian13"

[ "$(id -u)" -eq 0 ] || { echo "newer_dolfinx: needs root, try sudo" >&2; exit 1; }
command -v debootstrap >/dev/null || apt-get install -y -qq debootstrap

if [ ! -e "$system/etc/debian_version" ]; then
  mkdir -p "$system"
  debootstrap --variant=minbase --include=ca-certificates trixie "$system"
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
  set -- -m fenicsx
fi
chroot "$system" /usr/bin/env HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  OMP_NUM_THREADS=1 OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 sh -c '
    cd /opt/rom
    .ci/setup.sh
    .venv/bin/python -c "import dolfinx; print(\"dolfinx\", dolfinx.__version__)"
    exec .venv/bin/python -m pytest "$@"' sh "$@"
