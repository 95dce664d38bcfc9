// The shapes of a world, by id; equal ones are found by what they look like on the wire.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera {

class ShapeTable {
 public:
  explicit ShapeTable(std::vector<Shape> shapes) : shapes_(std::move(shapes)) {}

  std::span<const Shape> shapes() const { return shapes_; }
  ShapeId next_id() const { return static_cast<ShapeId>(shapes_.size()); }

  // The id of the shape that is equal, bit for bit, if there is one.
  std::optional<ShapeId> find(const Shape& shape);

  // Appends under next_id(); pop() takes the last one away again.
  void push(Shape shape) { shapes_.push_back(std::move(shape)); }
  void pop();

 private:
  std::vector<Shape> shapes_;
  std::unordered_multimap<std::size_t, ShapeId> index_;  // by hash of the serialised shape
  std::size_t indexed_ = 0;  // shapes in the index: made when it is first asked, most worlds never ask
};

}  // namespace tessera
