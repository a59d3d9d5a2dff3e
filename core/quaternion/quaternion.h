// SPDX-License-Identifier: LGPL-2.1-or-later
// Scalar quaternions over any real type, with the paper's exponential and logarithm.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace qdmd {

// True where no part of a sum of squares of that size was lost to underflow, nor to overflow.
template <typename Real>
bool square_is_safe(const Real& squared) {
  return squared > std::numeric_limits<Real>::min() / std::numeric_limits<Real>::epsilon() &&
         squared <= std::numeric_limits<Real>::max();
}

// q = w + x i + y j + z k. Real is double, a wider float or a multiprecision type.
// As a pair of complex numbers it is q = (w + x i) + (y + z i) j.
template <typename Real>
struct Quaternion {
  Real w{0}, x{0}, y{0}, z{0};

  using Complex = std::complex<Real>;

  Quaternion() = default;
  Quaternion(Real w_, Real x_, Real y_, Real z_) : w(w_), x(x_), y(y_), z(z_) {}
  explicit Quaternion(Real real) : w(real) {}
  explicit Quaternion(const Complex& a, const Complex& b = Complex(Real(0)))
      : w(a.real()), x(a.imag()), y(b.real()), z(b.imag()) {}

  Complex a() const { return Complex(w, x); }
  Complex b() const { return Complex(y, z); }

  Quaternion conj() const { return {w, -x, -y, -z}; }
  Real squared_norm() const { return w * w + x * x + y * y + z * z; }
  Real norm() const {
    using std::sqrt;
    return sqrt(squared_norm());
  }
  // Length of the vector part V(q).
  Real vector_norm() const {
    using std::sqrt;
    return sqrt(x * x + y * y + z * z);
  }
  // |w|, |x|, |y| or |z|, whichever is largest.
  Real largest_part() const {
    using std::abs;
    return std::max(std::max(Real(abs(w)), Real(abs(x))), std::max(Real(abs(y)), Real(abs(z))));
  }
  // 1 / q; not finite for zero, and where 1 / |q| overflows.
  Quaternion inverse() const {
    const Real squared = squared_norm();
    if (square_is_safe(squared)) return conj() * (Real(1) / squared);
    const Quaternion scaled = *this * (Real(1) / largest_part());
    return scaled.conj() * (Real(1) / scaled.squared_norm()) * (Real(1) / largest_part());
  }
  // q / |q|; one where q is zero, so that it can always serve as a phase.
  Quaternion unit() const {
    const Real squared = squared_norm();
    using std::sqrt;
    if (square_is_safe(squared)) return *this * (Real(1) / Real(sqrt(squared)));
    const Real inverse = Real(1) / largest_part();
    // Zero, or so small that it has few digits left.
    if (!(inverse <= std::numeric_limits<Real>::max())) return Quaternion(Real(1));
    const Quaternion scaled = *this * inverse;
    return scaled * (Real(1) / scaled.norm());
  }

  Quaternion operator-() const { return {-w, -x, -y, -z}; }
  Quaternion& operator+=(const Quaternion& q) {
    w += q.w, x += q.x, y += q.y, z += q.z;
    return *this;
  }
  Quaternion& operator-=(const Quaternion& q) {
    w -= q.w, x -= q.x, y -= q.y, z -= q.z;
    return *this;
  }
  friend Quaternion operator+(Quaternion p, const Quaternion& q) { return p += q; }
  friend Quaternion operator-(Quaternion p, const Quaternion& q) { return p -= q; }
  friend Quaternion operator*(const Quaternion& p, const Quaternion& q) {
    return {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
            p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
            p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
            p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
  }
  friend Quaternion operator*(const Quaternion& p, const Real& s) {
    return {p.w * s, p.x * s, p.y * s, p.z * s};
  }
};

using Quaterniond = Quaternion<double>;

// e^q = e^S(q) (cos|V(q)| + V(q)/|V(q)| sin|V(q)|): the paper's Definition 2 ("fullexpo"), which
// for a pure quaternion is Definition 1 ("exppure"). A null vector part is the real exponential.
template <typename Real>
Quaternion<Real> exp(const Quaternion<Real>& q) {
  using std::cos, std::exp, std::sin;
  const Real angle = q.vector_norm();
  const Real scale = exp(q.w);
  // sin(angle) / angle is 1 to within rounding below the square root of epsilon.
  const Real sinc = angle > Real(0) ? Real(sin(angle) / angle) : Real(1);
  const Real s = scale * sinc;
  return {scale * cos(angle), q.x * s, q.y * s, q.z * s};
}

// ln q = ln|q| + V(q)/|V(q)| atan2(|V(q)|, S(q)): the paper's Definition 3 ("logarithm") by the
// formula that follows it, ln q = ln|q| + mu phi, with its arctan read as atan2 so that every
// quadrant is right. A negative real has no axis of its own: i is taken, the choice that makes ln
// agree with the principal complex logarithm. ln 0 is -infinity + 0.
template <typename Real>
Quaternion<Real> log(const Quaternion<Real>& q) {
  using std::atan2, std::log;
  const Real length = q.norm();
  if (!(length > Real(0))) return Quaternion<Real>(-std::numeric_limits<Real>::infinity());
  const Real sine = q.vector_norm();
  const Real angle = atan2(sine, q.w);
  if (!(sine > Real(0))) return {log(length), angle, Real(0), Real(0)};
  const Real s = angle / sine;
  return {log(length), q.x * s, q.y * s, q.z * s};
}

// Unit d with conj(d) q d = S(q) + |V(q)| i: turns a quaternion into the representative of its
// eigenvalue class that has a non-negative imaginary part (the paper's Definition 5, "Eigenvalue
// class", and Theorem 1, "standard eigenvalues").
template <typename Real>
Quaternion<Real> standardizing_rotation(const Quaternion<Real>& q) {
  const Real sine = q.vector_norm();
  if (!(sine > Real(0))) return Quaternion<Real>(Real(1));
  const Quaternion<Real> u{Real(0), q.x / sine, q.y / sine, q.z / sine};
  // d = u p + p i solves u d = d i for every p; p = 1 or j keeps d away from zero.
  const Quaternion<Real> d = u.x >= Real(0) ? Quaternion<Real>{Real(0), u.x + Real(1), u.y, u.z}
                                            : Quaternion<Real>{-u.y, -u.z, Real(0), u.x - Real(1)};
  return d.unit();
}

}  // namespace qdmd
