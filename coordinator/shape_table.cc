#include "coordinator/shape_table.h"

#include <functional>

#include "proto/convert.h"

namespace tessera {

std::optional<ShapeId> ShapeTable::find(const Shape& shape) {
  const std::hash<std::string> hash;
  for (; indexed_ < shapes_.size(); ++indexed_) {
    const std::string bytes = to_proto(shapes_[indexed_]).SerializeAsString();
    bytes_ += bytes.size();
    index_.emplace(hash(bytes), static_cast<ShapeId>(indexed_));
  }
  const std::string bytes = to_proto(shape).SerializeAsString();
  const auto [begin, end] = index_.equal_range(hash(bytes));
  for (auto candidate = begin; candidate != end; ++candidate) {
    if (to_proto(shapes_[candidate->second]).SerializeAsString() == bytes) return candidate->second;
  }
  return std::nullopt;
}

void ShapeTable::pop() {
  const std::size_t bytes = to_proto(shapes_.back()).ByteSizeLong();
  shapes_.pop_back();
  if (indexed_ <= shapes_.size()) return;
  bytes_ -= bytes;
  indexed_ = shapes_.size();
  std::erase_if(index_, [&](const auto& entry) { return entry.second >= shapes_.size(); });
}

}  // namespace tessera
