#include "coordinator/shape_table.h"

#include <functional>
#include <memory>
#include <string>

#include "lpss/base/invariant.h"
#include "proto/convert.h"

namespace tessera {

ShapeTable::ShapeTable(std::vector<Shape> shapes) {
  for (Shape& shape : shapes) {
    const ShapeId id = next_++;
    add({id, std::make_shared<const Shape>(std::move(shape))}, 0);
  }
}

void ShapeTable::add(const ShapeEntry& entry, Tick since) {
  entries_.emplace_hint(entries_.end(), entry.id, Entry{.shape = entry.shape, .since = since});
  not_indexed_.push_back(entry.id);
}

ShapeId ShapeTable::add(Shape shape, Tick since, Undo& undo) {
  const ShapeId id = next_++;
  add({id, std::make_shared<const Shape>(std::move(shape))}, since);
  undo.add([this, id] {
    const auto found = entries_.find(id);
    take_from_index(id, found->second);
    bytes_ -= found->second.bytes;
    entries_.erase(found);
    next_ = id;
  });
  return id;
}

const Shape* ShapeTable::find(ShapeId id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() && found->second.until == kNever ? found->second.shape.get() : nullptr;
}

void ShapeTable::index_new() {
  for (const ShapeId id : std::exchange(not_indexed_, {})) {
    const auto found = entries_.find(id);
    if (found == entries_.end() || found->second.until != kNever || found->second.is_indexed) continue;
    Entry& entry = found->second;
    const std::string form = to_proto(*entry.shape).SerializeAsString();
    entry.is_indexed = true;
    entry.hash = std::hash<std::string>()(form);
    entry.bytes = form.size();
    bytes_ += entry.bytes;
    index_.emplace(entry.hash, id);
  }
}

std::optional<ShapeId> ShapeTable::find_equal(const Shape& shape) {
  index_new();
  const std::string form = to_proto(shape).SerializeAsString();
  const auto [begin, end] = index_.equal_range(std::hash<std::string>()(form));
  for (auto candidate = begin; candidate != end; ++candidate) {
    if (to_proto(*ref(candidate->second)).SerializeAsString() == form) return candidate->second;
  }
  return std::nullopt;
}

void ShapeTable::give_back(ShapeId id, Tick at, Undo& undo) {
  Entry& entry = entries_.at(id);
  invariant(entry.bodies > 0, "a shape is given back by those who took it");
  if (--entry.bodies == 0) leave(id, at);
  undo.add([this, id, at] {
    Entry& back = entries_.at(id);
    if (++back.bodies > 1) return;
    back.until = kNever;
    left_.erase({at, id});
    if (back.is_indexed) {
      index_.emplace(back.hash, id);
    } else {
      not_indexed_.push_back(id);
    }
  });
}

void ShapeTable::leave(ShapeId id, Tick at) {
  Entry& entry = entries_.at(id);
  entry.until = at;
  left_.emplace(at, id);
  take_from_index(id, entry);
}

void ShapeTable::take_from_index(ShapeId id, const Entry& entry) {
  if (!entry.is_indexed) return;
  const auto [begin, end] = index_.equal_range(entry.hash);
  for (auto candidate = begin; candidate != end; ++candidate) {
    if (candidate->second != id) continue;
    index_.erase(candidate);
    return;
  }
}

std::vector<ShapeEntry> ShapeTable::at(Tick tick) const {
  std::vector<ShapeEntry> shapes;
  for (const auto& [id, entry] : entries_) {
    if (entry.since <= tick && tick < entry.until) shapes.push_back({id, entry.shape});
  }
  return shapes;
}

void ShapeTable::drop_before(Tick tick) {
  while (!left_.empty() && left_.begin()->first <= tick) {
    const auto entry = entries_.find(left_.begin()->second);
    bytes_ -= entry->second.bytes;
    entries_.erase(entry);
    left_.erase(left_.begin());
  }
}

}  // namespace tessera
