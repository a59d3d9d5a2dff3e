#!/usr/bin/env bash
# Builds core/ for 64-bit ARM, whose vectors are NEON, with a cross compiler, and runs tests under
# QEMU: the passes against their slow references, and whether scenes give the bytes that they give
# here. Half an hour, most of it compiling; everything is kept in build-neon.
#
#   tests/neon.sh [TEST...]      by their names in tests/core (default: those of the passes, golden)
set -euo pipefail
cd "$(dirname "$0")/.."
tests/install-dependencies.sh build neon
tests=("$@")
[ "$#" -gt 0 ] || tests=(kernel gram passes chroma digits combine mask_passes soft_mask resample robust_fill median_picture pool golden)
build=$PWD/build-neon
mkdir -p "$build/packages"

# ARM's libraries in a folder of their own: the machine's list of architectures stays as it is.
if [ ! -e "$build/root/usr/include/hwy" ]; then
  state=(-o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Dir::State="$build/apt"
    -o Dir::State::status=/dev/null -o Dir::Cache="$build/apt" -o APT::Sandbox::User=root)
  mkdir -p "$build/apt/lists/partial" "$build/apt/archives/partial"
  (cd "$build/packages" &&
    apt-get -q "${state[@]}" update && apt-get -q "${state[@]}" download libhwy1 libhwy-dev libgtest-dev) \
    >"$build/packages.log" 2>&1 || { tail -n 20 "$build/packages.log" >&2; exit 1; }
  for package in "$build"/packages/*.deb; do dpkg -x "$package" "$build/root"; done
fi
libraries=$build/root/usr/lib/aarch64-linux-gnu

# Scenes are rendered here, with OpenCV.
[ -f build/build.ninja ] || meson setup build -Dtests=enabled -Dscene=enabled >"$build/meson.log"
mkdir -p "$build/frames"
export QDMD_GOLDEN_FRAMES=$build/frames
if [ "$(find "$build/frames" -name '*.raw' | wc -l)" -lt 3 ]; then
  ninja -C build -j "$(tests/jobs.sh)" tests/core/golden_test >"$build/make.log"
  build/tests/core/golden_test --gtest_brief=1
fi

# Effects that need OpenCV are not there, and are not called.
cat >"$build/Makefile" <<MAKE
CXX = ${ARM_CXX:-aarch64-linux-gnu-g++}
FLAGS = -std=c++20 -O2 -ffp-contract=off -I. -isystem $build/root/usr/include -isystem /usr/include/eigen3 \\
  -DQDMD_GOLDEN_FILE='"$PWD/tests/core/golden.txt"'
SOURCES = \$(shell git grep -L opencv2/ 'core/*.cpp' ':!core/library' ':!core/metrics')
OBJECTS = \$(SOURCES:%.cpp=$build/%.o)
.PRECIOUS: $build/%.o
$build/%_test: $build/tests/core/%_test.o $build/tests/core/test_util.o $build/core.a
	\$(CXX) \$^ -o \$@ -L$libraries -Wl,--unresolved-symbols=ignore-all -lgtest_main -lgtest -lhwy -pthread
$build/core.a: \$(OBJECTS)
	rm -f \$@; aarch64-linux-gnu-ar rcs \$@ \$^
$build/%.o: %.cpp
	@mkdir -p \$(@D); echo \$<
	@\$(CXX) \$(FLAGS) -MMD -c \$< -o \$@
-include \$(shell find $build -name '*.d')
MAKE
programs=("${tests[@]/#/$build/}")
make -f "$build/Makefile" -j "$(tests/jobs.sh)" "${programs[@]/%/_test}" \
  >"$build/make.log" 2>&1 || { tail -n 30 "$build/make.log" >&2; exit 1; }

for test in "${tests[@]}"; do
  echo "== $test: NEON"
  qemu-aarch64-static -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH="$libraries" \
    "$build/${test}_test" --gtest_brief=1
done
