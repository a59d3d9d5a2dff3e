#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Compiles the adapter against OpenCV's interface as it is since 2026, in which cv::BackgroundSubtractor asks for a
# second apply(), with a known foreground: newest_opencv.sh INCLUDE_FOLDER, where OpenCV's headers of this machine are.
set -euo pipefail
include=$1
tests=$(realpath "$(dirname "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# This machine's headers with the new function and a version that has it.
mkdir -p "$work/new/opencv2/core" "$work/new/opencv2/video"
sed 's/^#define CV_VERSION_MINOR .*/#define CV_VERSION_MINOR 14/' "$include/opencv2/core/version.hpp" \
  >"$work/new/opencv2/core/version.hpp"
sed '0,/virtual void apply(InputArray image, OutputArray fgmask, double learningRate=-1) = 0;/s//&\
    virtual void apply(InputArray image, InputArray knownForegroundMask, OutputArray fgmask, double learningRate=-1) = 0;/' \
  "$include/opencv2/video/background_segm.hpp" >"$work/new/opencv2/video/background_segm.hpp"
grep -q 'InputArray knownForegroundMask' "$work/new/opencv2/video/background_segm.hpp"

cat >"$work/use.cpp" <<'END'
#include "core/library/opencv.h"
void use(const cv::Mat& frame, const cv::Mat& known, cv::Mat mask) {
  const cv::Ptr<cv::BackgroundSubtractor> it = qdmd::library::create_background_subtractor();
  it->apply(frame, mask);
  it->apply(frame, mask, 0);
#ifdef QDMD_TEST_NEWEST
  it->apply(frame, known, mask);
  it->apply(frame, known, mask, 0.5);
#endif
  qdmd::library::BackgroundSubtractor().apply(frame, known, mask, 0.5);
}
END
compile() { "${CXX:-c++}" -std=c++17 -fsyntax-only -Wall -Wextra -Wsuggest-override -Werror -I"$tests/../.." "$@" "$work/use.cpp"; }
compile -isystem "$include"
compile -DQDMD_TEST_NEWEST -isystem "$work/new" -isystem "$include"
# That the new interface is asked for at all: a class without the second apply() is abstract.
cat >"$work/old.cpp" <<'END'
#include <opencv2/video/background_segm.hpp>
struct Old : cv::BackgroundSubtractor {
  void apply(cv::InputArray, cv::OutputArray, double) override {}
  void getBackgroundImage(cv::OutputArray) const override {}
};
Old old;
END
if "${CXX:-c++}" -std=c++17 -fsyntax-only -isystem "$work/new" -isystem "$include" "$work/old.cpp" 2>/dev/null; then
  echo "the headers made here do not ask for the second apply()" >&2
  exit 1
fi
