#include "experiments/seams/stage.h"

#include <algorithm>

#include "experiments/paper/small_scenes.h"

namespace tessera::seams {
namespace {

constexpr const char* kPlacementNames[] = {"reference", "local", "remote", "corner"};
constexpr const char* kPolicyNames[] = {"none", "clone-1", "clone-2", "clone-4", "island"};

template <typename T, std::size_t n>
std::optional<T> named(const char* const (&names)[n], const std::string& name) {
  const auto found = std::find(std::begin(names), std::end(names), name);
  if (found == std::end(names)) return std::nullopt;
  return static_cast<T>(found - std::begin(names));
}

WorldSettings settings_for(const Scene& scene, Policy policy, Precision precision, double sector_size) {
  WorldSettings settings;
  settings.precision = precision;
  settings.sector_size = sector_size;
  settings.solver_iterations = scene.solver_iterations;
  settings.seams = policy == Policy::kIsland ? SeamPolicy::kIsland : SeamPolicy::kClone;
  settings.clone_depth = policy == Policy::kNone     ? 0
                         : policy == Policy::kClone2 ? 2
                         : policy == Policy::kClone4 ? 4
                                                     : 1;
  return settings;
}

absl::StatusOr<Stage> staged(const Scene& scene, const WorldSettings& settings,
                             const Eigen::Vector3d& origin) {
  absl::StatusOr<WorldDescription> world = scene.build(settings);
  if (!world.ok()) return world.status();
  if (absl::Status moved = move_to(*world, {{}, origin}); !moved.ok()) return moved;
  return Stage{*std::move(world), origin};
}

}  // namespace

const char* name_of(Placement placement) { return kPlacementNames[static_cast<int>(placement)]; }
const char* name_of(Policy policy) { return kPolicyNames[static_cast<int>(policy)]; }
std::optional<Placement> placement_named(const std::string& name) {
  return named<Placement>(kPlacementNames, name);
}
std::optional<Policy> policy_named(const std::string& name) { return named<Policy>(kPolicyNames, name); }

absl::StatusOr<Stage> stage(const Scene& scene, Placement placement, Policy policy, Precision precision) {
  const bool whole = placement == Placement::kReference;
  const double size = whole ? scene.reference_size : scene.sector_size;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (placement == Placement::kCorner) origin = Eigen::Vector3d::Constant(size / 2);
  if (placement == Placement::kLocal || placement == Placement::kRemote) origin = scene.seam * (size / 2);
  return staged(scene, settings_for(scene, policy, precision, size), origin);
}

absl::StatusOr<Stage> stage_elsewhere(const Scene& scene, int place, Precision precision) {
  // Where numbers are as coarse as at a border: in a sector of twice the size, just beyond the place of the
  // border, unless single precision does not allow that; then as far out as the scene fits.
  constexpr double kSizeMax = 512;  // m
  const bool doubled = 2 * scene.reference_size <= kSizeMax;
  const double size = doubled ? 2 * scene.reference_size : scene.reference_size;
  const double room = doubled ? 1.11 * scene.reference_size / 2 : scene.reference_size / 2 - scene.extent;
  const double sign[] = {place & 1 ? -1.0 : 1.0, place & 2 ? -1.0 : 1.0, place & 4 ? -1.0 : 1.0};
  const double odd = 1 - 0.0137 * place;
  const Eigen::Vector3d origin(sign[0] * room * odd, sign[1] * room * 0.9931 * odd, sign[2] * room * 0.9973);
  return staged(scene, settings_for(scene, Policy::kIsland, precision, size), origin);
}

}  // namespace tessera::seams
