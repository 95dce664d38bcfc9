#include "experiments/performance/scenes.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstdint>

#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

constexpr double kHalfFloor = 120;  // m

// Numbers in [0, 1), the same on every machine.
class Scatter {
 public:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 40) / static_cast<double>(1 << 24);
  }

 private:
  std::uint64_t state_ = 1;
};

}  // namespace

WorldDescription dropped_boxes(const WorldSettings& settings, int count) {
  WorldBuilder builder(settings);
  builder.add_floor(kHalfFloor, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  const int side = static_cast<int>(std::ceil(std::sqrt(count / 4.0)));
  Scatter scatter;
  for (int n = 0; n < count; ++n) {
    const int layer = n / (side * side);
    const int row = n % (side * side) / side;
    const int column = n % side;
    const double x = (column - side / 2.0) * 1.1 + 0.05 * scatter.next();
    const double y = (row - side / 2.0) * 1.1 + 0.05 * scatter.next();
    builder.add(absl::StrCat("box", n), box, 1, {x, y, 0.6 + 1.1 * layer});
  }
  return builder.world();
}

WorldDescription towers_of_ten(const WorldSettings& settings, int count) {
  constexpr int kHeight = 10;
  constexpr double kApart = 3;  // m
  WorldBuilder builder(settings);
  builder.add_floor(kHalfFloor, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  for (int n = 0; n < count; ++n) {
    const int column = n % side;
    const int row = n / side;
    const double x = (column - side / 2.0) * kApart;
    const double y = (row - side / 2.0) * kApart;
    for (int level = 0; level < kHeight; ++level) {
      builder.add(absl::StrCat("tower", n, "_", level), box, 1,
                  {x + 0.02 * (level % 3), y + 0.013 * (level % 2), 0.5 + level});
    }
  }
  return builder.world();
}

}  // namespace tessera
