// The shapes of a world under construction, without duplicates.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <string>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera {

class ShapeTable {
 public:
  // The index of the shape that is equal to `shape`, bit for bit; adds it if there is none.
  ShapeId add(Shape shape);

  std::vector<Shape> take() { return std::move(shapes_); }

 private:
  std::vector<Shape> shapes_;
  absl::flat_hash_map<std::string, ShapeId> places_;  // by the bytes of what the shape consists of
};

}  // namespace tessera
