// SPDX-License-Identifier: LGPL-2.1-or-later
// Double-double arithmetic against binary numbers wide enough to be exact.
#include "core/quaternion/double_double.h"

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// 2048 bits hold sums of numbers whose exponents differ by 1900, and all products.
using Wide = boost::multiprecision::number<
    boost::multiprecision::cpp_bin_float<2048, boost::multiprecision::digit_base_2>,
    boost::multiprecision::et_off>;

// The square of the unit roundoff: errors below are multiples of it.
constexpr double kUnit = 0x1p-106;

Wide wide(const DoubleDouble& x) { return Wide(x.hi) + Wide(x.lo); }

// |actual - expected| / |expected|, 0 for an exact zero.
double relative_error(const DoubleDouble& actual, const Wide& expected) {
  const Wide error = abs(wide(actual) - expected);
  if (error == 0) return 0;
  return static_cast<double>(Wide(error / abs(expected)));
}

bool is_normalized(const DoubleDouble& x) { return x.hi + x.lo == x.hi; }

// Any sign, exponents within +-`range`; every fourth has no low part, as pixels have.
class RandomNumbers {
 public:
  explicit RandomNumbers(unsigned seed) : rng_(seed) {}
  double number(int range) {
    return std::ldexp(mantissa_(rng_), static_cast<int>(rng_() % (2u * range + 1)) - range) *
           (rng_() % 2 ? 1 : -1);
  }
  DoubleDouble pair(int range) {
    const double hi = number(range);
    if (rng_() % 4 == 0) return hi;
    // Below half a unit of hi's last place, sometimes far below.
    const int gap = 54 + static_cast<int>(rng_() % 4 == 0 ? rng_() % 60 : 0);
    return DoubleDouble::sum_ordered(hi, std::ldexp(number(0), std::ilogb(hi) - gap));
  }
  unsigned next() { return static_cast<unsigned>(rng_()); }

 private:
  std::mt19937 rng_;
  std::uniform_real_distribution<double> mantissa_{1, 2};
};

constexpr int kTrials = 4000;

// ---- Error-free transformations ----

TEST(DoubleDouble, SumOfTwoDoublesIsExact) {
  RandomNumbers numbers(121);
  for (int trial = 0; trial < kTrials; ++trial) {
    const double a = numbers.number(trial % 2 ? 30 : 400), b = numbers.number(trial % 2 ? 30 : 400);
    const auto s = DoubleDouble::sum(a, b);
    ASSERT_EQ(s.hi, a + b);
    ASSERT_EQ(wide(s), Wide(a) + Wide(b));
    const bool ordered = std::abs(a) >= std::abs(b);
    ASSERT_TRUE(DoubleDouble::sum_ordered(ordered ? a : b, ordered ? b : a) == s);
  }
  const auto tie = DoubleDouble::sum(1, 0x1p-53);
  EXPECT_TRUE(tie == DoubleDouble(1, 0x1p-53));
}

TEST(DoubleDouble, ProductOfTwoDoublesIsExact) {
  RandomNumbers numbers(122);
  for (int trial = 0; trial < kTrials; ++trial) {
    const double a = numbers.number(400), b = numbers.number(400);
    const auto p = DoubleDouble::product(a, b);
    ASSERT_EQ(p.hi, a * b);
    ASSERT_EQ(wide(p), Wide(a) * Wide(b));
  }
  // All 53 bits set: the halves of a split are as large as they get.
  const double ones = 2 - 0x1p-52;
  EXPECT_EQ(wide(DoubleDouble::product(ones, -ones)), -Wide(ones) * Wide(ones));
}

// ---- Arithmetic ----

TEST(DoubleDouble, AdditionAndSubtraction) {
  RandomNumbers numbers(123);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = numbers.pair(trial % 2 ? 3 : 60), y = numbers.pair(trial % 2 ? 3 : 60);
    for (const auto& [actual, expected] :
         {std::pair{x + y, Wide(wide(x) + wide(y))}, {x - y, Wide(wide(x) - wide(y))}}) {
      // 3 units and a little (Joldes, Muller and Popescu 2017, theorem 3.1).
      ASSERT_LE(relative_error(actual, expected), 3.1 * kUnit);
      ASSERT_TRUE(is_normalized(actual));
    }
    ASSERT_TRUE(x + y == y + x);
    ASSERT_TRUE(x - x == DoubleDouble(0));
    ASSERT_TRUE(x + 0 == x);
  }
}

TEST(DoubleDouble, CancellationKeepsTheRelativeError) {
  RandomNumbers numbers(124);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = numbers.pair(10);
    // Agrees with x in 1 to 105 bits.
    const int bits = 1 + static_cast<int>(numbers.next() % 105);
    const auto y = x + DoubleDouble(std::ldexp(numbers.number(0), std::ilogb(x.hi) - bits));
    ASSERT_LE(relative_error(x - y, wide(x) - wide(y)), 3.1 * kUnit) << bits;
  }
  // The high parts cancel, the low ones do not, and the other way around.
  EXPECT_TRUE(DoubleDouble(1, 0x1p-60) - DoubleDouble(1, 0x1p-61) == DoubleDouble(0x1p-61));
  EXPECT_TRUE(DoubleDouble(1, 0x1p-60) - DoubleDouble(0x1p-60) == DoubleDouble(1));
}

TEST(DoubleDouble, MultiplicationAndDivision) {
  RandomNumbers numbers(125);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = numbers.pair(200), y = numbers.pair(200);
    // 5 and 9.8 units (Joldes, Muller and Popescu 2017, theorems 5.1 and 6.2).
    ASSERT_LE(relative_error(x * y, wide(x) * wide(y)), 5 * kUnit);
    ASSERT_LE(relative_error(x / y, wide(x) / wide(y)), 9.8 * kUnit);
    ASSERT_TRUE(is_normalized(x * y) && is_normalized(x / y));
    ASSERT_TRUE(x * 1 == x && x / 1 == x && x * -1 == -x);
    ASSERT_TRUE(x / x == DoubleDouble(1));
    ASSERT_TRUE(x * 0 == DoubleDouble(0));
  }
  // 1/3 has an error in neither part that a double would show.
  EXPECT_LE(relative_error(DoubleDouble(1) / 3, Wide(1) / 3), kUnit);
}

TEST(DoubleDouble, CompoundAssignmentIsTheOperator) {
  const DoubleDouble x = DoubleDouble(1) / 3, y = DoubleDouble(1) / 7;
  auto sum = x, difference = x, product = x, quotient = x;
  EXPECT_TRUE((sum += y) == x + y);
  EXPECT_TRUE((difference -= y) == x - y);
  EXPECT_TRUE((product *= y) == x * y);
  EXPECT_TRUE((quotient /= y) == x / y);
  // With itself on the right.
  EXPECT_TRUE((sum -= sum) == DoubleDouble(0));
  EXPECT_TRUE((quotient /= quotient) == DoubleDouble(1));
}

TEST(DoubleDouble, SquareRoot) {
  RandomNumbers numbers(126);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = abs(numbers.pair(300));
    // Newton from half a unit of a double: its square over 2, and the division's rounding.
    ASSERT_LE(relative_error(sqrt(x), sqrt(wide(x))), 4 * kUnit);
    ASSERT_TRUE(is_normalized(sqrt(x)));
    const double integer = std::floor(std::abs(numbers.number(25)));
    ASSERT_TRUE(sqrt(DoubleDouble::product(integer, integer)) == DoubleDouble(integer));
  }
  EXPECT_TRUE(sqrt(DoubleDouble(0)) == DoubleDouble(0));
  EXPECT_TRUE(std::isnan(sqrt(DoubleDouble(-1)).hi));
}

// ---- Everything else that matrices ask for ----

TEST(DoubleDouble, ComparisonsLookAtBothParts) {
  RandomNumbers numbers(127);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto x = numbers.pair(2);
    // Often equal, or different in the last bits only.
    auto y = trial % 3 ? x : numbers.pair(2);
    if (trial % 3 == 1) y.lo = -y.lo;
    const Wide a = wide(x), b = wide(y);
    ASSERT_EQ(x == y, a == b);
    ASSERT_EQ(x != y, a != b);
    ASSERT_EQ(x < y, a < b);
    ASSERT_EQ(x > y, a > b);
    ASSERT_EQ(x <= y, a <= b);
    ASSERT_EQ(x >= y, a >= b);
    ASSERT_EQ(wide(abs(x)), abs(a));
    ASSERT_EQ(wide(-x), -a);
    ASSERT_EQ(static_cast<double>(x), static_cast<double>(a));
  }
}

TEST(DoubleDouble, NotANumberComparesFalse) {
  const DoubleDouble nan = std::nan(""), one = 1;
  for (const auto& [x, y] : {std::pair{nan, one}, {one, nan}, {nan, nan}}) {
    EXPECT_FALSE(x == y || x < y || x > y || x <= y || x >= y);
    EXPECT_TRUE(x != y);
  }
  EXPECT_FALSE(isfinite(nan));
  EXPECT_FALSE(isfinite(DoubleDouble(kInfinity)));
  EXPECT_TRUE(isfinite(one));
}

TEST(DoubleDouble, ScalingByPowersOfTwoIsExact) {
  RandomNumbers numbers(128);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto x = numbers.pair(100);
    int exponent = 0;
    const auto mantissa = frexp(x, &exponent);
    ASSERT_GE(std::abs(mantissa.hi), 0.5);
    ASSERT_LT(std::abs(mantissa.hi), 1);
    ASSERT_TRUE(ldexp(mantissa, exponent) == x);
    ASSERT_EQ(wide(ldexp(x, -70)), ldexp(wide(x), -70));
  }
}

TEST(DoubleDouble, EpsilonBoundsOneOperation) {
  using Limits = std::numeric_limits<DoubleDouble>;
  EXPECT_TRUE(DoubleDouble(1) + Limits::epsilon() > DoubleDouble(1));
  EXPECT_GE(static_cast<double>(Limits::epsilon()), 4 * kUnit);
  // The smallest number whose square root's square is still accurate to epsilon.
  const auto root = sqrt(Limits::min());
  EXPECT_LE(relative_error(root * root, wide(Limits::min())), 16 * kUnit);
}

// ---- Inside the factorization ----

using Matrix = QuaternionMatrix<DoubleDouble>;

Matrix extended(const QuaternionMatrixd& m) {
  const auto widen = [](const std::complex<double>& c) {
    return std::complex<DoubleDouble>(c.real(), c.imag());
  };
  return {m.a.unaryExpr(widen), m.b.unaryExpr(widen)};
}

TEST(DoubleDouble, CholeskyReproducesAnIntegerGramMatrix) {
  std::mt19937 rng(129);
  for (int m : {1, 2, 24, 40}) {
    const auto g = extended(quaternion_gram_of(noisy_clip(200, static_cast<size_t>(m), 3, rng)));
    const auto factor = cholesky(g, gram_tolerance<DoubleDouble>(m));
    ASSERT_TRUE(factor.complete());
    const auto error = factor.r.conjugate_transpose() * factor.r - g;
    // Higham, theorem 10.3, in units of a double-double product.
    EXPECT_LE(static_cast<double>(error.norm() / g.norm()), 16 * 5 * (m + 1) * kUnit);
  }
}

TEST(DoubleDouble, CholeskyIsAsGoodAsAQrOfThePixels) {
  // Frames that differ in one sample: the columns are 60000 times as long as their differences.
  std::mt19937 rng(130);
  Clip clip = static_clip(random_picture(20000, rng, 200, 255), 6);
  for (size_t t = 0; t < clip.size(); ++t) clip.at(t, 0, t) = 199;
  const auto g = quaternion_gram_of(clip);
  const auto factor = cholesky(extended(g), gram_tolerance<DoubleDouble>(6));
  ASSERT_TRUE(factor.complete());
  const auto rounded = factor.r.a.unaryExpr([](const std::complex<DoubleDouble>& c) {
    return std::complex<double>(c.real().hi, c.imag().hi);
  });
  const auto expected = qr(to_quaternions(clip), false).r;
  // Householder QR in double: sums of 20000 pixels, whose roundings have any sign, relative to the
  // longest column.
  const double tolerance = std::sqrt(20000) * kEpsilon * expected.norm();
  EXPECT_LE((rounded - expected.a).cwiseAbs().maxCoeff(), tolerance);
  const auto in_double = cholesky(g, 0.0);
  ASSERT_TRUE(in_double.complete());
  EXPECT_GT((in_double.r.a - expected.a).cwiseAbs().maxCoeff(), tolerance)
      << "the test has to see something";
}

TEST(DoubleDouble, CholeskyStopsWhereTheRankEnds) {
  std::mt19937 rng(131);
  for (int rank : {1, 3, 30}) {
    // Integer factors have an exact Gram matrix.
    const auto x = to_quaternions(random_clip(static_cast<size_t>(rank), 40, rng));
    const auto g = extended(x.conjugate_transpose() * x);
    EXPECT_EQ(cholesky(g, gram_tolerance<DoubleDouble>(40)).pivots, rank);
    EXPECT_EQ(pivoted_cholesky(g, gram_tolerance<DoubleDouble>(40)).pivots, rank);
  }
}

}  // namespace
}  // namespace qdmd::test
