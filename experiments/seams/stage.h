// Places a scene: the placement determines where the borders of sectors are, the policy what happens there.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "experiments/seams/scene.h"

namespace tessera::seams {

enum class Placement : std::uint8_t {
  kReference,  // the whole scene in the middle of one sector
  kLocal,      // a border through the scene's origin
  kRemote,     // the same, with the sectors on two servers
  kCorner,     // the corner of eight sectors at the origin
};

enum class Policy : std::uint8_t {
  kNone,  // sectors ignore each other
  kClone1,
  kClone2,
  kClone4,
  kIsland,
};

inline constexpr Placement kPlacements[] = {Placement::kReference, Placement::kLocal, Placement::kRemote,
                                            Placement::kCorner};
inline constexpr Policy kPolicies[] = {Policy::kNone, Policy::kClone1, Policy::kClone2, Policy::kClone4,
                                       Policy::kIsland};

const char* name_of(Placement placement);
const char* name_of(Policy policy);
std::optional<Placement> placement_named(const std::string& name);
std::optional<Policy> policy_named(const std::string& name);

// A world with a scene, and the scene's origin in metres from the centre of the anchor's sector.
struct Stage {
  WorldDescription world;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

// Errors: those of the scene's files, and of validate().
absl::StatusOr<Stage> stage(const Scene& scene, Placement placement, Policy policy, Precision precision);

// The reference with its origin elsewhere in the same sector, so that numbers are rounded differently.
// `place` is 0 to kReferencesElsewhere - 1.
absl::StatusOr<Stage> stage_elsewhere(const Scene& scene, int place, Precision precision);
inline constexpr int kReferencesElsewhere = 8;

}  // namespace tessera::seams
