// Conversion between the types of the SDK and the JSON of the web UI. 64-bit numbers (sector indices, ids of
// nodes) are strings there: JavaScript numbers hold 53 bits.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "lpss/grid/world_position.h"
#include "lpss/model/shape.h"
#include "tessera/client.h"
#include "worlds/loader/look.h"

namespace tessera::viewer {

nlohmann::json to_json(const SectorIndex& sector);
nlohmann::json to_json(const Eigen::Vector3d& vector);
// {"sector": ["i", "j", "k"], "local": [x, y, z]}, and "frame" where that is one that moves.
nlohmann::json to_json(const WorldPosition& position);
nlohmann::json to_json(const Shape& shape);
nlohmann::json to_json(const Look& look);  // parts of a shape, each with its "colour", 0xRRGGBB
nlohmann::json to_json(const FoundBody& body);

// INVALID_ARGUMENT if a field is missing or has another type.
absl::StatusOr<WorldPosition> position_from(const nlohmann::json& json);
// Of a position: the world's if no field says so.
absl::StatusOr<FrameNumber> frame_from(const nlohmann::json& json);
absl::StatusOr<Eigen::Vector3d> vector_from(const nlohmann::json& json);
absl::StatusOr<std::uint64_t> natural_from(const nlohmann::json& json);

// A message of a page; discarded() if it is not JSON, or nested deeper than kNestingMax.
inline constexpr int kNestingMax = 16;
nlohmann::json message_from(std::string_view text);

// One line of JSON; invalid UTF-8 in strings is replaced.
std::string dump(const nlohmann::json& json);

}  // namespace tessera::viewer
