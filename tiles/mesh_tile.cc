#include "tiles/mesh_tile.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "lpss/model/limits.h"

namespace tessera {
namespace {

absl::Status wrong(std::size_t line, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ": ", what));
}

using Words = std::vector<absl::string_view>;

absl::Status add_vertex(const Words& words, std::size_t line, Tile& tile) {
  if (words.size() < 4) return wrong(line, "a vertex must have 3 numbers");
  Eigen::Vector3d& vertex = tile.vertices.emplace_back();
  for (int axis = 0; axis < 3; ++axis) {
    if (!absl::SimpleAtod(words[axis + 1], &vertex[axis]) || !(std::abs(vertex[axis]) <= kStaticExtentMax))
      return wrong(
          line, absl::StrCat("'", words[axis + 1], "' must be a number of at most ", kStaticExtentMax, " m"));
  }
  return absl::OkStatus();
}

absl::Status add_face(const Words& words, std::size_t line, Tile& tile) {
  if (words.size() < 4) return wrong(line, "a face must have 3 corners or more");
  std::vector<std::uint32_t> corners;
  for (std::size_t n = 1; n < words.size(); ++n) {
    const std::pair<absl::string_view, absl::string_view> number =
        absl::StrSplit(words[n], absl::MaxSplits('/', 1));
    std::int64_t corner = 0;
    const auto count = static_cast<std::int64_t>(tile.vertices.size());
    const bool is_number = absl::SimpleAtoi(number.first, &corner);
    if (corner < 0) corner += count + 1;  // from the last one back
    if (!is_number || corner < 1 || corner > count)
      return wrong(line, absl::StrCat("'", words[n], "' must be a vertex before, 1 to ", count));
    corners.push_back(static_cast<std::uint32_t>(corner - 1));
  }
  for (std::size_t n = 2; n < corners.size(); ++n)
    tile.triangles.push_back({corners[0], corners[n - 1], corners[n]});
  if (tile.triangles.size() > kTileTrianglesMax)
    return wrong(line, absl::StrCat("there must be at most ", kTileTrianglesMax, " triangles"));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Tile> read_obj(absl::string_view text) {
  Tile tile;
  std::size_t line = 0;
  for (const absl::string_view row : absl::StrSplit(text, '\n')) {
    ++line;
    const Words words = absl::StrSplit(row, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    absl::Status status;
    if (words[0] == "v") status = add_vertex(words, line, tile);
    if (words[0] == "f") status = add_face(words, line, tile);
    if (!status.ok()) return status;
  }
  return tile;
}

}  // namespace tessera
