#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs a program under valgrind: run_valgrind.sh VALGRIND ARGUMENT... Skips where the processor hides RDTSCP, as that of
# some virtual machines does: valgrind tells programs that it is there, and ends those that use it. Highway does when it
# is loaded.
set -euo pipefail
if [ "$(uname -m)" = x86_64 ] && [ -r /proc/cpuinfo ] && ! grep -qw rdtscp /proc/cpuinfo; then
  echo "skipped: valgrind cannot run Highway on a processor without RDTSCP"
  exit 77
fi
exec "$@"
