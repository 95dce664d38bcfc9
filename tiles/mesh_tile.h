// Tiles of triangles in Wavefront OBJ.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include "lpss/ground/tile.h"

namespace tessera {

inline constexpr std::size_t kTileTrianglesMax = 1'000'000;  // of a file

// The vertices and faces of a file's text; all else in it is skipped. Faces of more than three corners become
// fans. INVALID_ARGUMENT, with the line, for numbers that are none or out of range, and for more than
// kTileTrianglesMax triangles.
absl::StatusOr<Tile> read_obj(absl::string_view text);

}  // namespace tessera
