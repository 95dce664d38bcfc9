// What bodies look like.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera {

// In the frame of a body. The parts of meshes are their objects.
struct Look {
  Shape shape;
  std::vector<std::uint32_t> colours;  // of its parts: 0xRRGGBB, as screens show it
};

struct Looks {
  std::string world;                                                     // its name
  absl::flat_hash_map<std::string, std::shared_ptr<const Look>> bodies;  // by their names
};

// Of the visuals of a link: with more, it has no look.
inline constexpr std::size_t kLookTrianglesMax = 200'000;

}  // namespace tessera
