#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Prints how many compilers may run at once: one for each core, and 2 GB of free memory for each, since
# Eigen's largest files take that much.
set -euo pipefail
room=$(awk '/^MemAvailable/ { print int($2 / 2e6) }' /proc/meminfo)
cores=$(nproc)
jobs=$((room < cores ? room : cores))
echo $((jobs > 0 ? jobs : 1))
