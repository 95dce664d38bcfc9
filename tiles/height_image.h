// Height maps: images of grey as heights.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace tessera {

struct HeightImage {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::vector<double> heights;  // 0 (black) to 1 (white), row by row from the top of the image
};

// A PNG of 8 or 16 bits; of colours counts the red, as in Gazebo. Or a TIFF: see decoded_tiff(). NOT_FOUND
// without such a file; INVALID_ARGUMENT if it is none, or has more than kHeightFieldSamplesMax pixels.
absl::StatusOr<HeightImage> read_height_image(const std::filesystem::path& file);

// A PNG by its bytes. INVALID_ARGUMENT likewise.
absl::StatusOr<HeightImage> decoded_image(absl::string_view file);

// Columns and rows alone.
absl::StatusOr<std::pair<std::uint32_t, std::uint32_t>> size_of_image(absl::string_view file);

}  // namespace tessera
