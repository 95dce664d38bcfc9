// What both engines keep for all their worlds: shapes, and pairs of bodies that joints exclude.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>

#include "lpss/engine/require.h"
#include "lpss/model/body.h"

namespace tessera {

// The shapes of a world in the form of an engine, which is shared by all bodies with the same shape and
// centre frame, and forgotten some time after the last of these. `Built` is made from (Shape, Pose centre,
// bool is_static). Safe to use from any thread.
template <typename Built>
class ShapeTable {
 public:
  void add(ShapeId id, const Shape& shape) {
    const std::lock_guard lock(mutex_);
    shapes_.emplace(id, shape);
  }

  // Worlds that still have bodies of it keep its form.
  void forget(ShapeId id) {
    const std::lock_guard lock(mutex_);
    shapes_.erase(id);
    constexpr double kLeast = -std::numeric_limits<double>::infinity();
    const Key first{id, {kLeast, kLeast, kLeast}, {kLeast, kLeast, kLeast, kLeast}, false};
    auto last = built_.lower_bound(first);
    const auto begin = last;
    while (last != built_.end() && std::get<ShapeId>(last->first) == id) ++last;
    built_.erase(begin, last);
  }

  // Stops the process if the shape is unknown.
  std::shared_ptr<const Built> of(const BodyProperties& properties) {
    const bool is_static = properties.motion == Motion::kStatic;
    const Key key{properties.shape, properties.centre, properties.principal_axes, is_static};
    const std::lock_guard lock(mutex_);
    std::shared_ptr<const Built>& built = built_[key];
    if (built) return built;
    const auto shape = shapes_.find(properties.shape);
    require(shape != shapes_.end(), "a body's shape must be added before the body");
    std::shared_ptr<const Built> made = built =
        std::make_shared<const Built>(shape->second, centre_frame(properties), is_static);
    if (built_.size() >= forget_at_) forget_unused();
    return made;
  }

  // Of forms, some of which may be of no body.
  std::size_t built_count() {
    const std::lock_guard lock(mutex_);
    return built_.size();
  }

  // No more are kept than so many, or than twice as many as are in use.
  static constexpr std::size_t kUnusedMax = 32;

 private:
  using Key = std::tuple<ShapeId, std::array<double, 3>, std::array<double, 4>, bool>;

  void forget_unused() {
    std::erase_if(built_, [](const auto& entry) { return entry.second.use_count() == 1; });
    forget_at_ = std::max(kUnusedMax, 2 * built_.size());
  }

  std::mutex mutex_;  // guards all members below
  std::map<ShapeId, Shape> shapes_;
  std::map<Key, std::shared_ptr<const Built>> built_;
  std::size_t forget_at_ = kUnusedMax;
};

// Pairs of bodies that do not collide. Reference-counted: several joints may exclude the same pair, and each
// removes only its own exclusion.
class ApartPairs {
 public:
  void set(BodyId a, BodyId b, bool apart) {
    const auto key = std::minmax(a, b);
    if (apart) {
      ++times_[key];
    } else if (const auto entry = times_.find(key); entry != times_.end() && --entry->second == 0) {
      times_.erase(entry);
    }
  }
  bool contains(BodyId a, BodyId b) const { return !times_.empty() && times_.contains(std::minmax(a, b)); }

 private:
  // The lower id first.
  absl::flat_hash_map<std::pair<BodyId, BodyId>, int> times_;  // number of joints that exclude the pair; > 0
};

}  // namespace tessera
