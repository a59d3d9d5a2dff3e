// SPDX-License-Identifier: LGPL-2.1-or-later
// Numbers of about 32 decimal digits as unevaluated sums of two doubles.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace qdmd {

// hi + lo with |lo| <= ulp(hi) / 2 (Dekker 1971; the names of the parts are those of Hida, Li and
// Bailey's QD library). Additions and products are good to a few 2^-104. Needs strict IEEE double
// arithmetic: no -ffast-math, no contraction. Infinities and overflow are not handled.
struct DoubleDouble {
  double hi = 0, lo = 0;

  DoubleDouble() = default;
  DoubleDouble(double value) : hi(value) {}  // NOLINT: exact, as from int to double
  DoubleDouble(double hi_, double lo_) : hi(hi_), lo(lo_) {}
  explicit operator double() const { return hi; }

  // a + b exactly (Knuth's two-sum), and with |a| >= |b| (Dekker's fast two-sum).
  static DoubleDouble sum(double a, double b) {
    const double s = a + b, t = s - a;
    return {s, (a - (s - t)) + (b - t)};
  }
  static DoubleDouble sum_ordered(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
  }
  // a b exactly.
  static DoubleDouble product(double a, double b) {
    const double p = a * b;
#ifdef FP_FAST_FMA
    return {p, std::fma(a, b, -p)};
#else
    // Veltkamp's split into halves of 26 bits, whose products are exact.
    constexpr double kSplit = 134217729;
    const double sa = kSplit * a, sb = kSplit * b;
    const double a_hi = sa - (sa - a), b_hi = sb - (sb - b);
    const double a_lo = a - a_hi, b_lo = b - b_hi;
    return {p, ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo};
#endif
  }

  DoubleDouble operator-() const { return {-hi, -lo}; }
  DoubleDouble& operator+=(const DoubleDouble& x) { return *this = *this + x; }
  DoubleDouble& operator-=(const DoubleDouble& x) { return *this = *this - x; }
  DoubleDouble& operator*=(const DoubleDouble& x) { return *this = *this * x; }
  DoubleDouble& operator/=(const DoubleDouble& x) { return *this = *this / x; }
  // Both parts are added exactly: the error stays relative even where the sum cancels.
  friend DoubleDouble operator+(const DoubleDouble& x, const DoubleDouble& y) {
    DoubleDouble s = sum(x.hi, y.hi);
    const DoubleDouble t = sum(x.lo, y.lo);
    s = sum_ordered(s.hi, s.lo + t.hi);
    return sum_ordered(s.hi, s.lo + t.lo);
  }
  friend DoubleDouble operator-(const DoubleDouble& x, const DoubleDouble& y) { return x + -y; }
  friend DoubleDouble operator*(const DoubleDouble& x, const DoubleDouble& y) {
    const DoubleDouble p = product(x.hi, y.hi);
    return sum_ordered(p.hi, p.lo + (x.hi * y.lo + x.lo * y.hi));
  }
  friend DoubleDouble operator/(const DoubleDouble& x, const DoubleDouble& y) {
    const double q1 = x.hi / y.hi;
    DoubleDouble r = x - y * q1;
    const double q2 = r.hi / y.hi;
    r -= y * q2;
    return sum_ordered(q1, q2) + DoubleDouble(r.hi / y.hi);
  }
  friend bool operator==(const DoubleDouble& x, const DoubleDouble& y) {
    return x.hi == y.hi && x.lo == y.lo;
  }
  friend bool operator<(const DoubleDouble& x, const DoubleDouble& y) {
    return x.hi < y.hi || (x.hi == y.hi && x.lo < y.lo);
  }
  friend bool operator!=(const DoubleDouble& x, const DoubleDouble& y) { return !(x == y); }
  friend bool operator>(const DoubleDouble& x, const DoubleDouble& y) { return y < x; }
  // Not as !(y < x): what is not a number compares false.
  friend bool operator<=(const DoubleDouble& x, const DoubleDouble& y) { return x < y || x == y; }
  friend bool operator>=(const DoubleDouble& x, const DoubleDouble& y) { return y <= x; }
};

inline DoubleDouble abs(const DoubleDouble& x) { return x.hi < 0 ? -x : x; }
inline DoubleDouble sqrt(const DoubleDouble& x) {
  if (!(x.hi > 0)) return std::sqrt(x.hi);
  // One Newton step from the double root (Karp and Markstein 1997).
  const double root = std::sqrt(x.hi);
  return DoubleDouble::sum_ordered(root, (x - DoubleDouble::product(root, root)).hi / (2 * root));
}
inline bool isfinite(const DoubleDouble& x) { return std::isfinite(x.hi); }
inline DoubleDouble frexp(const DoubleDouble& x, int* exponent) {
  const double hi = std::frexp(x.hi, exponent);
  return {hi, std::ldexp(x.lo, -*exponent)};
}
inline DoubleDouble ldexp(const DoubleDouble& x, int exponent) {
  return {std::ldexp(x.hi, exponent), std::ldexp(x.lo, exponent)};
}

}  // namespace qdmd

template <>
class std::numeric_limits<qdmd::DoubleDouble> : public std::numeric_limits<double> {
 public:
  static constexpr int digits = 104, digits10 = 31;
  static qdmd::DoubleDouble epsilon() { return 0x1p-104; }
  // Below this a product's low part underflows.
  static qdmd::DoubleDouble min() { return 0x1p-960; }
  static qdmd::DoubleDouble max() { return std::numeric_limits<double>::max(); }
  static qdmd::DoubleDouble lowest() { return std::numeric_limits<double>::lowest(); }
};

namespace Eigen {
template <>
struct NumTraits<qdmd::DoubleDouble> : GenericNumTraits<qdmd::DoubleDouble> {
  enum { AddCost = 20, MulCost = 24, ReadCost = 2 };
  static qdmd::DoubleDouble dummy_precision() { return 0x1p-90; }
};
}  // namespace Eigen
