// Height maps in TIFF files, as tools for maps write them.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include "tiles/height_image.h"

namespace tessera {

// Whether the bytes of a file begin as those of a TIFF.
bool is_tiff(absl::string_view file);

// The first image of a TIFF: 8 or 16 bits without a sign, from 0 (black) to 1 (white) as in other images; or
// numbers with a sign, of 8 to 32 bits, and of floating point (GeoTIFF), which are heights: shares of the
// largest one. Of several samples counts the first. INVALID_ARGUMENT for anything else, and for more than
// kHeightFieldSamplesMax pixels.
absl::StatusOr<HeightImage> decoded_tiff(absl::string_view file);

}  // namespace tessera
