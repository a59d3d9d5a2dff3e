#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Prints what windows on disk take if a process has a quarter of their size as memory, for the table of
# docs/archive.md. Takes ten minutes, and needs root and the memory controller of cgroups (v1 or v2).
#
#   tests/pages/window_on_disk.sh FOLDER    FOLDER: on the disk that is measured
set -euo pipefail
folder=$(realpath "$1")
source "$(dirname "$0")/common.sh"
build gst/libgstqdmd.so

group=/sys/fs/cgroup/memory/qdmd-window limit=memory.limit_in_bytes
if [ ! -d /sys/fs/cgroup/memory ]; then
  group=/sys/fs/cgroup/qdmd-window limit=memory.max
  echo +memory >/sys/fs/cgroup/cgroup.subtree_control
fi
mkdir -p "$group"
trap 'rmdir "$group"' EXIT

# measure BYTES WIDTH HEIGHT FRAMES SETTING...: -1: as much as there is
measure() {
  local bytes=$1 width=$2 height=$3 frames=$4
  shift 4
  [ "$bytes" != -1 ] || [ "$limit" != memory.max ] || bytes=max
  echo "$bytes" >"$group/$limit"
  (
    echo "$BASHPID" >"$group/cgroup.procs"
    /usr/bin/python3 - gst-launch-1.0 -q videotestsrc "num-buffers=$frames" pattern="${pattern:-ball}" ! \
      "video/x-raw,format=I420,width=$width,height=$height,framerate=25/1" ! qdmdbackground \
      "window-size=$frames" max-memory=100000000000 output=mask "$@" ! filesink "location=$results/masks" <<'P'
import os, sys, time
start = time.perf_counter()
child = os.spawnvp(os.P_NOWAIT, sys.argv[1], sys.argv[1:])
status = os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)
with open(f'/proc/{child}/io') as io:
    read = next(int(line.split()[1]) for line in io if line.startswith('read_bytes'))
usage = os.wait4(child, 0)[2]
print(f'{time.perf_counter() - start:.0f} s, {usage.ru_utime + usage.ru_stime:.0f} s of processors, '
      f'{read / 1e9:.1f} GB read, exit status {status.si_status}')
P
  )
  echo "$*: $(md5sum <"$results/masks" | cut -c1-8)"
  rm -f "$results/masks"
}

uptime
measure -1 1920 1080 1000
measure -1 1920 1080 1000 window-on-disk="$folder"
measure $((778 << 20)) 1920 1080 1000 window-on-disk="$folder"
export pattern=snow
measure -1 1280 720 600 method=qdmd
measure $((300 << 20)) 1280 720 600 method=qdmd window-on-disk="$folder"
