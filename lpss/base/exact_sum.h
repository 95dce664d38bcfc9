// Sums that do not depend on the order of what is added.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera {

// In units of 2^-40, as the two halves of a number of 128 bits. What is added is cut off below, and held
// within +-2^64, so that some millions fit. What is no number adds nothing.
struct ExactSum {
  std::int64_t high = 0;
  std::uint64_t low = 0;

  void add(double value) {
    constexpr double kMost = 18446744073709551616.0;  // 2^64
    if (value == value) set(whole() + static_cast<__int128>(std::clamp(value, -kMost, kMost) * kUnits));
  }
  ExactSum& operator+=(const ExactSum& other) {
    set(whole() + other.whole());
    return *this;
  }
  double value() const { return static_cast<double>(whole()) / kUnits; }

  friend bool operator==(const ExactSum&, const ExactSum&) = default;

 private:
  static constexpr double kUnits = 1099511627776.0;  // 2^40

  __int128 whole() const {
    return static_cast<__int128>((static_cast<unsigned __int128>(static_cast<std::uint64_t>(high)) << 64) |
                                 low);
  }
  void set(__int128 sum) {
    high = static_cast<std::int64_t>(sum >> 64);
    low = static_cast<std::uint64_t>(sum);
  }
};

}  // namespace tessera
