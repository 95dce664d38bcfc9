// The shapes of a world, by id, with how many bodies have them. One that no body has any more is forgotten:
// by spawns at once, and by snapshots and checkpoints from the tick on that takes its last body away. Equal
// shapes are found by their serialised form.
#pragma once

#include <absl/container/btree_map.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "coordinator/undo.h"
#include "lpss/model/shape.h"
#include "lpss/tick/messages.h"

namespace tessera {

class ShapeTable {
 public:
  // Of a world that is described, at tick 0.
  explicit ShapeTable(std::vector<Shape> shapes);

  // `next` is above the ids of all that are given to add().
  explicit ShapeTable(ShapeId next) : next_(next) {}

  // Servers have it from tick `since` on; later ones have higher ids.
  void add(const ShapeEntry& entry, Tick since);

  // Under an id that no shape had before.
  ShapeId add(Shape shape, Tick since, Undo& undo);

  // Null for shapes that no body has any more.
  const Shape* find(ShapeId id) const;

  // The id of an equal shape, bit for bit, if there is one.
  std::optional<ShapeId> find_equal(const Shape& shape);

  // One that servers have not forgotten.
  const ShapeRef& ref(ShapeId id) const { return entries_.at(id).shape; }

  // A body more, and a body less; the last one leaves at tick `at`, when servers forget the shape.
  void take(ShapeId id) { ++entries_.at(id).bodies; }
  // Of a body that was never there.
  void release(ShapeId id) { --entries_.at(id).bodies; }
  bool has_one_body(ShapeId id) const { return entries_.at(id).bodies == 1; }
  void give_back(ShapeId id, Tick at, Undo& undo);
  void leave(ShapeId id, Tick at);

  // Those that servers have at the end of a tick, which no drop_before() has passed; ascending by ids.
  std::vector<ShapeEntry> at(Tick tick) const;

  // Nobody will ask for an earlier tick again.
  void drop_before(Tick tick);

  // With those that have left, and are not dropped yet.
  std::size_t size() const { return entries_.size(); }
  std::size_t bytes() const { return bytes_; }  // serialised, but for those added after the last find_equal()
  ShapeId next_id() const { return next_; }

 private:
  static constexpr Tick kNever = std::numeric_limits<Tick>::max();

  struct Entry {
    ShapeRef shape;
    Tick since = 0;
    Tick until = kNever;
    std::uint64_t bodies = 0;
    bool is_indexed = false;
    std::size_t hash = 0;  // of the serialised form, once it is indexed, and
    std::size_t bytes = 0;
  };

  void index_new();
  void take_from_index(ShapeId id, const Entry& entry);

  absl::btree_map<ShapeId, Entry> entries_;
  ShapeId next_ = 0;
  std::vector<ShapeId> not_indexed_;  // the index is built on first use: most worlds never need it
  std::unordered_multimap<std::size_t, ShapeId> index_;  // by hash, of those that have not left
  std::set<std::pair<Tick, ShapeId>> left_;              // until that tick
  std::size_t bytes_ = 0;
};

}  // namespace tessera
