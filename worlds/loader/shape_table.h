// The shapes of a world under construction, each different one once.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <string>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera {

class ShapeTable {
 public:
  // The place of a shape that is equal to `shape` bit for bit; added where there was none.
  ShapeId add(Shape shape);

  std::vector<Shape> take() { return std::move(shapes_); }

 private:
  std::vector<Shape> shapes_;
  absl::flat_hash_map<std::string, ShapeId> places_;  // by the bytes of what the shape consists of
};

}  // namespace tessera
