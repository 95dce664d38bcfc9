#include "simulator/any_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestExponent = -12;  // of ten, of numbers of any size
constexpr std::uint64_t kOutsideOneIn = 8;
constexpr std::uint64_t kSmallCount = 4;

}  // namespace

double AnyNumber::within(const NumberRange& range) {
  if (!is_valid_ && dice_.one_in(kOutsideOneIn)) return outside(range);
  const double usual_low = std::max(range.low, -range.usual);
  const double usual_high = std::min(range.high, range.usual);
  const auto clamped = [&range](double number) { return std::clamp(number, range.low, range.high); };
  switch (dice_.below(16)) {
    case 0:
      return clamped(0);
    case 1:
      return range.low;
    case 2:
      return range.high;
    case 3:
      return clamped(dice_.one_in(2) ? std::numeric_limits<double>::denorm_min()
                                     : std::numeric_limits<double>::min());
    case 4:
    case 5:
    case 6: {  // of any size
      const double largest = std::min(std::max(std::abs(range.low), std::abs(range.high)), 1e300);
      const double size = std::pow(10, dice_.between(kSmallestExponent, std::log10(std::max(largest, 1.0))));
      return clamped(range.low < 0 && dice_.one_in(2) ? -size : size);
    }
    default:
      return usual_low < usual_high ? dice_.between(usual_low, usual_high) : clamped(usual_low);
  }
}

double AnyNumber::outside(const NumberRange& range) {
  const std::array<double, 9> numbers = {std::nan(""),
                                         kInfinity,
                                         -kInfinity,
                                         std::nextafter(range.high, kInfinity),
                                         std::nextafter(range.low, -kInfinity),
                                         std::numeric_limits<double>::max(),
                                         std::numeric_limits<double>::lowest(),
                                         -std::numeric_limits<double>::denorm_min(),
                                         -0.0};
  return numbers[dice_.below(numbers.size())];
}

std::uint64_t AnyNumber::count() {
  if (!is_valid_ && dice_.one_in(kOutsideOneIn)) {
    constexpr std::array<std::uint64_t, 4> kLarge = {UINT64_MAX, std::uint64_t{1} << 53, UINT32_MAX,
                                                     std::uint64_t{1} << 31};
    return kLarge[dice_.below(kLarge.size())];
  }
  return dice_.below(kSmallCount);
}

}  // namespace tessera
