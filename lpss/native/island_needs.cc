#include "lpss/native/island_needs.h"

#include <algorithm>
#include <cstdint>

namespace tessera::native {
namespace {

constexpr double kLightBurden = 1.5;
constexpr double kUsualBurden = 20;
constexpr double kUsualFall = 9.81 / (60 * 60);  // m
constexpr double kTurnMax = 0.125;               // rad, in one step
constexpr int kStepsMax = 64;

// The neighbours of each body, in the order of the touches.
class Neighbours {
 public:
  Neighbours(std::size_t bodies, std::span<const ContactEdge> touches) : begin_(bodies + 1, 0) {
    for_each(touches, [&](std::size_t body, std::size_t) { ++begin_[body + 1]; });
    for (std::size_t body = 0; body < bodies; ++body) begin_[body + 1] += begin_[body];
    all_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for_each(touches, [&](std::size_t body, std::size_t other) { all_[next[body]++] = other; });
  }

  std::span<const std::size_t> of(std::size_t body) const {
    return std::span(all_).subspan(begin_[body], begin_[body + 1] - begin_[body]);
  }

 private:
  template <typename Visit>
  static void for_each(std::span<const ContactEdge> touches, const Visit& visit) {
    for (const ContactEdge& touch : touches) {
      if (touch.a == ContactEdge::kGround || touch.b == ContactEdge::kGround) continue;
      visit(touch.a, touch.b);
      visit(touch.b, touch.a);
    }
  }

  std::vector<std::size_t> begin_;
  std::vector<std::size_t> all_;
};

}  // namespace

std::vector<double> load_ratios(std::span<const double> masses, std::span<const ContactEdge> touches) {
  constexpr std::uint32_t kUnknown = ~std::uint32_t{0};
  const Neighbours neighbours(masses.size(), touches);
  std::vector<std::uint32_t> height(masses.size(), kUnknown);  // contacts from the ground
  std::vector<std::size_t> order;                              // by height
  order.reserve(masses.size());
  const auto reach = [&](std::size_t body, std::uint32_t at) {
    if (height[body] != kUnknown) return;
    height[body] = at;
    order.push_back(body);
  };
  for (const ContactEdge& touch : touches) {
    if (touch.a == ContactEdge::kGround && touch.b != ContactEdge::kGround) reach(touch.b, 0);
    if (touch.b == ContactEdge::kGround && touch.a != ContactEdge::kGround) reach(touch.a, 0);
  }
  for (std::size_t n = 0; n < order.size(); ++n) {
    for (const std::size_t other : neighbours.of(order[n])) reach(other, height[order[n]] + 1);
  }

  std::vector<double> carried(masses.size(), 0);
  for (auto body = order.rbegin(); body != order.rend(); ++body) {
    const auto is_below = [&](std::size_t other) { return height[other] + 1 == height[*body]; };
    const std::span<const std::size_t> around = neighbours.of(*body);
    const auto supports = std::count_if(around.begin(), around.end(), is_below);
    const double share =
        (masses[*body] + carried[*body]) / static_cast<double>(std::max<std::ptrdiff_t>(supports, 1));
    for (const std::size_t other : around) {
      if (is_below(other)) carried[other] += share;
    }
  }
  for (std::size_t body = 0; body < masses.size(); ++body) carried[body] /= masses[body];
  return carried;
}

double load_in_tick(double load_ratio, double fall) { return load_ratio * std::max(1.0, fall / kUsualFall); }

int steps_for(double load_ratio, int usual) {
  if (load_ratio <= kLightBurden) return std::max(2, usual / 2);
  int steps = usual;
  for (double most = kUsualBurden; load_ratio > most && 2 * steps <= kStepsMax; most *= 4) steps *= 2;
  return steps;
}

int steps_for_turn(double turn, int usual) {
  int steps = usual;
  for (double most = kTurnMax * usual; turn > most && 2 * steps <= kStepsMax; most *= 2) steps *= 2;
  return steps;
}

}  // namespace tessera::native
