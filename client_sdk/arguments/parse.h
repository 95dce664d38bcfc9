// What people type on command lines: numbers, vectors, sectors, shapes, lengths and times.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <cstdint>

#include "lpss/grid/sector_index.h"
#include "lpss/model/shape.h"

namespace tessera {

// Worlds are moved by at most this many sectors along each axis: 2^62.
inline constexpr std::int64_t kShiftMax = std::int64_t{1} << 62;

// A whole number in decimal digits or as a power of two: "12", "-7", "2^40", "-2^62". INVALID_ARGUMENT for
// other text, OUT_OF_RANGE where it leaves the 64-bit range.
absl::StatusOr<std::int64_t> parse_integer(absl::string_view text);

// "I,J,K". Errors as parse_integer(), and OUT_OF_RANGE beyond kShiftMax.
absl::StatusOr<SectorOffset> parse_shift(absl::string_view text);

// "I,J,K" of any 64-bit value; "I,J,K,N" in the N-th frame of the world that moves.
absl::StatusOr<SectorIndex> parse_sector(absl::string_view text);

// "X,Y,Z", finite. INVALID_ARGUMENT for other text.
absl::StatusOr<Eigen::Vector3d> parse_vector(absl::string_view text);

// "box:X,Y,Z", "sphere:RADIUS", "capsule:RADIUS,LENGTH", "cylinder:RADIUS,LENGTH", "ellipsoid:X,Y,Z" (radii)
// or "plane:X,Y,Z" (normal, made unit length). INVALID_ARGUMENT for other text; bounds are validate()'s
// business.
absl::StatusOr<Shape> parse_shape(absl::string_view text);

// A length in m: "0.5", "0.5m", "2cm", "1mm", "20um". INVALID_ARGUMENT for other text, and unless it is
// positive.
absl::StatusOr<double> parse_length(absl::string_view text);

// A time in s: "2", "2s", "500ms", "1m". Errors as parse_length().
absl::StatusOr<double> parse_seconds(absl::string_view text);

}  // namespace tessera
