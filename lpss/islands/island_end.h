// Islands in lists of many.
#pragma once

#include <cstddef>

namespace tessera {

// Where the bodies, contacts and joints of an island end; they begin where those of the island before it end.
struct IslandEnd {
  std::size_t bodies = 0;
  std::size_t contacts = 0;
  std::size_t joints = 0;
  int substeps = 0;  // that its contacts ask for
};

}  // namespace tessera
