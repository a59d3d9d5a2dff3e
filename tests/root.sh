#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs a command in a Debian of its own, such as Debian 13 on Debian 12, as root or through sudo:
#
#   tests/root.sh NAME COMMAND...     NAME is a suite of Debian, `trixie`, or one with an ending, `trixie-arm64`;
#                                     with the ending `-on-arm64`, its programs are for that processor, and
#                                     QEMU runs them, slowly
#   tests/root.sh --path NAME         prints where it is
#   tests/root.sh --tree NAME         puts the last commit into /root/gst-qdmd there, as `meson dist` gives it
#
# It is made if it is not there, bare, from the archive that apt is set up with on this machine, below
# QDMD_ROOTS (/var/tmp/qdmd-roots). With all that the tests need it takes 4 GB; `rm -r` takes it away.
set -euo pipefail
if [ "$(id -u)" -ne 0 ]; then exec sudo "QDMD_ROOTS=${QDMD_ROOTS:-}" "$(realpath "$0")" "$@"; fi
cd "$(dirname "$0")/.."
path_of() { echo "${QDMD_ROOTS:-/var/tmp/qdmd-roots}/$1"; }
if [ "$1" = --path ]; then
  path_of "$2"
  exit
fi
take_tree() {
  [ -z "$(git status --porcelain)" ] || echo "What is not committed is left out."
  tests/install-dependencies.sh build
  [ -f build/build.ninja ] || meson setup build >/dev/null
  meson dist -C build --no-tests --allow-dirty --formats gztar >/dev/null
  tests/root.sh "$1" mkdir -p /root/gst-qdmd
  local tree
  tree=$(path_of "$1")/root/gst-qdmd
  rm -rf "$tree"
  mkdir "$tree"
  tar -xzf build/meson-dist/gst-qdmd-*.tar.gz -C "$tree" --strip-components=1
}
if [ "$1" = --tree ]; then
  take_tree "$2"
  exit
fi
name=$1
shift
suite=${name%%-*}
root=$(path_of "$name")
arch=$(dpkg --print-architecture)
[[ $name != *-on-* ]] || arch=${name##*-on-}

make_root() {
  local mirror option options=()
  mirror=$(apt-get indextargets --format '$(ORIGIN) $(LABEL) $(REPO_URI)' 'Created-By: Packages' |
    awk '$1 == "Debian" && $2 == "Debian" { print $3; exit }')
  if [ -z "$mirror" ]; then
    echo "apt knows no archive of Debian's: see /etc/apt, and run apt-get update." >&2
    exit 1
  fi
  # Proxies and the like are as on this machine.
  while IFS= read -r option; do options+=(--aptopt="$option"); done < <(
    apt-config dump Acquire | grep -iE '^Acquire::(https?::proxy|Check-)')
  rm -rf "$root.part"
  mkdir -p "$(dirname "$root")"
  echo "Making a root of $suite in $root"
  if ! mmdebstrap --mode=root --variant=minbase --architectures="$arch" "${options[@]}" "$suite" "$root.part" "$mirror" \
    >"$root.log" 2>&1; then
    tail -n 20 "$root.log" >&2
    exit 1
  fi
  mv "$root.part" "$root"
}
# The kernel has QEMU run programs for another processor. Where systemd does not run, nobody has told it.
run_foreign() {
  local cpu known=/proc/sys/fs/binfmt_misc
  tests/install-dependencies.sh foreign
  cpu=$(dpkg-architecture -qDEB_HOST_GNU_CPU -a"$arch" 2>/dev/null)
  [ -e "$known/register" ] || mount -t binfmt_misc none "$known"
  [ -e "$known/qemu-$cpu" ] || tr -d '\n' <"/usr/lib/binfmt.d/qemu-$cpu.conf" >"$known/register"
}
[ "$arch" = "$(dpkg --print-architecture)" ] || run_foreign
if [ ! -d "$root" ]; then
  tests/install-dependencies.sh root
  make_root
fi

cp /etc/resolv.conf "$root/etc/"
exec unshare --mount --pid --fork --kill-child bash -c '
  mount --rbind /dev "$0/dev"
  mount -t proc proc "$0/proc"
  mount -t sysfs -o ro sysfs "$0/sys"
  exec chroot "$0" env -i HOME=/root LANG=C.UTF-8 TERM="${TERM:-dumb}" DEBIAN_FRONTEND=noninteractive \
    PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$@"' "$root" "$@"
