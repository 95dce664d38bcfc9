#include "lpss/base/arithmetic_fingerprint.h"

#include <absl/strings/str_cat.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <limits>

#include "lpss/base/portable_math.h"

namespace tessera {
namespace {

// FNV-1a over the bits of numbers.
class Hash {
 public:
  void add(float number) { add_bits(std::bit_cast<std::uint32_t>(number)); }
  void add(double number) { add_bits(std::bit_cast<std::uint64_t>(number)); }
  template <typename Scalar, int rows, int columns>
  void add(const Eigen::Matrix<Scalar, rows, columns>& numbers) {
    for (Eigen::Index n = 0; n < numbers.size(); ++n) add(numbers(n));
  }
  std::uint64_t value() const { return value_; }

 private:
  void add_bits(std::uint64_t bits) {
    for (int shift = 0; shift < 64; shift += 8) value_ = (value_ ^ (bits >> shift & 0xff)) * 0x100000001b3;
  }
  std::uint64_t value_ = 0xcbf29ce484222325;
};

// The same number, unknown to the compiler, which would compute with it at build time.
template <typename Scalar>
Scalar opaque(Scalar number) {
  volatile Scalar hidden = number;
  return hidden;
}

constexpr int kSamples = 64;

// Numbers from 1 to 2 with all digits in use.
template <typename Scalar>
Scalar sample(int n) {
  const Scalar golden = opaque(Scalar(0.6180339887498949));
  const Scalar multiple = golden * static_cast<Scalar>(n + 1);
  return 1 + (multiple - std::floor(multiple));
}

template <typename Scalar>
void add_operations(Hash& hash) {
  for (int n = 0; n < kSamples; ++n) {
    const Scalar a = sample<Scalar>(n);
    const Scalar b = sample<Scalar>(3 * n + 1);
    const Scalar c = sample<Scalar>(5 * n + 2);
    hash.add(a / b);
    hash.add(std::sqrt(a));
    hash.add(a * b + c);  // other bits if contracted
    hash.add(a * b - b * c);
    hash.add((a + b * Scalar(1e6)) + c);
    hash.add(std::fma(a, b, -c));
    hash.add(std::rint(a * 100));
  }
  const Scalar least = opaque(std::numeric_limits<Scalar>::min());
  for (int n = 0; n < kSamples; ++n) {
    const Scalar denormal = least / (sample<Scalar>(n) * 8);
    hash.add(denormal);
    hash.add(denormal * 3 + denormal);
  }
}

template <typename Scalar>
void add_products(Hash& hash) {
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  Matrix a;
  Matrix b;
  for (int n = 0; n < 9; ++n) {
    a(n) = sample<Scalar>(n);
    b(n) = sample<Scalar>(2 * n + 7);
  }
  const Eigen::Quaternion<Scalar> p(a(0), a(1), a(2), a(3));
  const Eigen::Quaternion<Scalar> q(b(0), b(1), b(2), b(3));
  hash.add(Matrix(a * b));
  hash.add(Vector(a * b.col(0)));
  hash.add(Vector(a.col(1).cross(b.col(2))));
  hash.add(a.col(0).dot(b.col(1)));
  hash.add((p * q).coeffs());
  hash.add(p.normalized().coeffs());
  hash.add(q.normalized().toRotationMatrix());
  hash.add(Vector(q * a.col(0)));
}

void add_functions(Hash& hash) {
  for (int n = 0; n < kSamples; ++n) {
    const double x = sample<double>(n);
    const portable::SinCos small = portable::sincos(x * 4 - 6);
    const portable::SinCos large = portable::sincos(std::ldexp(x, 10 * n));
    for (const double value : {small.sin, small.cos, large.sin, large.cos}) hash.add(value);
    hash.add(portable::sincos_degrees(x * 720).sin);
    hash.add(portable::asin(x - 1));
    hash.add(portable::atan2(x - 1.5, sample<double>(n + 1) - 1.5));
    hash.add(portable::pow(x / 2, sample<double>(n + 2) / 60));
  }
}

struct Part {
  const char* name;
  void (*add)(Hash& hash);
};
constexpr std::array<Part, kArithmeticParts> kParts = {{
    {"operations in single precision (compiler flags)", add_operations<float>},
    {"operations in double precision (compiler flags)", add_operations<double>},
    {"Eigen's products in single precision (compiler flags, the version of Eigen)", add_products<float>},
    {"Eigen's products in double precision (compiler flags, the version of Eigen)", add_products<double>},
    {"SLEEF's functions (the version of libsleef)", add_functions},
}};

std::uint64_t computed() {
  Hash hash;
  for (const Part& part : kParts) part.add(hash);
  return hash.value();
}

}  // namespace

std::uint64_t arithmetic_fingerprint() {
  static const std::uint64_t fingerprint = computed();
  return fingerprint;
}

const std::array<std::uint64_t, kArithmeticParts>& arithmetic_parts() {
  static const std::array<std::uint64_t, kArithmeticParts> parts = [] {
    std::array<std::uint64_t, kArithmeticParts> hashes{};
    for (std::size_t n = 0; n < kArithmeticParts; ++n) {
      Hash hash;
      kParts[n].add(hash);
      hashes[n] = hash.value();
    }
    return hashes;
  }();
  return parts;
}

std::string differing_arithmetic(std::span<const std::uint64_t> others) {
  std::string names;
  if (others.size() != kArithmeticParts) return names;
  for (std::size_t n = 0; n < kArithmeticParts; ++n) {
    if (others[n] != arithmetic_parts()[n])
      absl::StrAppend(&names, names.empty() ? "" : ", ", kParts[n].name);
  }
  return names;
}

}  // namespace tessera
