#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Names each source file that does not say in its first two lines under which licence it is: licence_test.sh SOURCE.
set -euo pipefail
cd "$1"
line='SPDX-License-Identifier: LGPL-2.1-or-later'
mapfile -t files < <(find core gst examples python tests meson.build meson_options.txt -type f \
  '(' -name '*.cpp' -o -name '*.h' -o -name '*.py' -o -name '*.pyi' -o -name '*.sh' -o -name 'meson*' -o -name '*.supp' \
  -o -path gst/debian/rules ')')
without=()
for file in "${files[@]}"; do head -n 2 "$file" | grep -q "^\(//\|#\) $line\$" || without+=("$file"); done
if [ "${#without[@]}" -gt 0 ]; then
  printf '%s\n' "${without[@]}" >&2
  echo "These files need the line \"// $line\", or with #, at their head." >&2
  exit 1
fi
echo "${#files[@]} files say their licence"
