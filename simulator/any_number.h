// Numbers at random, with what lies on bounds, just beyond them, and far from all that is sensible.
#pragma once

#include <cstdint>

#include "simulator/dice.h"

namespace tessera {

struct NumberRange {
  double low = 0;
  double high = 0;
  double usual = 10;  // most numbers are not larger than that
};

class AnyNumber {
 public:
  // With `is_valid`, all numbers are within their ranges.
  AnyNumber(Dice& dice, bool is_valid) : dice_(dice), is_valid_(is_valid) {}

  double within(const NumberRange& range);
  // From zero and small ones to the largest that there is.
  std::uint64_t count();

 private:
  double outside(const NumberRange& range);

  Dice& dice_;
  const bool is_valid_;
};

}  // namespace tessera
