// SPDX-License-Identifier: LGPL-2.1-or-later
// Constants that shape results, and builds in which they can be set from outside.
#pragma once

namespace qdmd {

// In ordinary builds a step is a constant. With -Dlearning-steps=adjustable, it is read when the
// program starts from the environment: QDMD_STEPS="proofs.settled=0.14,looks.steady=7".
//   QDMD_STEP float kSettled = step("proofs.settled", 0.2f);
// The type of a step is that of its value.
#ifdef QDMD_ADJUSTABLE
#define QDMD_STEP inline const
constexpr bool kAdjustable = true;

// What QDMD_STEPS says of a name, or `value`.
double adjusted(const char* name, double value);
template <typename T>
T step(const char* name, T value) {
  return static_cast<T>(adjusted(name, static_cast<double>(value)));
}
// Ends the program where QDMD_STEPS has a name that no step has. After all steps were read.
void check_steps();
#else
#define QDMD_STEP inline constexpr
constexpr bool kAdjustable = false;

template <typename T>
constexpr T step(const char*, T value) {
  return value;
}
inline void check_steps() {}
#endif

}  // namespace qdmd
