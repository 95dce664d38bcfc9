// The shapes of a world, by id; equal shapes are found by their serialised form.
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

  // The id of an equal shape, bit for bit, if there is one.
  std::optional<ShapeId> find(const Shape& shape);

  // Of the serialised shapes, but for those that were pushed after the last find().
  std::size_t bytes() const { return bytes_; }

  // Appends under next_id(); pop() removes the last one.
  void push(Shape shape) { shapes_.push_back(std::move(shape)); }
  void pop();

 private:
  std::vector<Shape> shapes_;
  std::unordered_multimap<std::size_t, ShapeId> index_;  // by hash of the serialised shape
  std::size_t bytes_ = 0;                                // of the shapes in the index
  std::size_t indexed_ = 0;  // shapes in the index, which is built on first use: most worlds never need it
};

}  // namespace tessera
