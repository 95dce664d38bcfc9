// Questions about any number of sectors: each is asked near its own centre. Between ticks. Sectors at rest
// that are packed come back when they are asked.
//
// Each server answers for its own sectors. The answer is, on any number of servers, what comes first of all
// of these in the order of (distance, body): a static body may be found by several servers, and its smallest
// distance counts. Bodies that the filter does not want are passed through.
#pragma once

#include <absl/container/inlined_vector.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "lpss/observe/line_walk.h"
#include "lpss/observe/passing_worlds.h"
#include "lpss/observe/sector_path.h"
#include "lpss/partition/partition.h"

namespace tessera {

struct RayAnswer {
  BodyId body;
  double distance = 0;  // m, from the origin of the ray, or that a probe has gone
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // on the body
};

// The order in which the first one counts. A body that is found from several places may be told with
// different normals at one distance: which place says so first must not matter.
inline auto order_of(const RayAnswer& answer) {
  return std::tuple(answer.distance, answer.body, answer.normal.x(), answer.normal.y(), answer.normal.z());
}

// Any number of questions, which share what has to be made for them: cheaper than one by one. May be kept
// from tick to tick, as long as the partition.
class Queries {
 public:
  explicit Queries(Partition& partition) : partition_(partition) {}

  // Looks for bodies that are farther outside of their home than it is looked for them: what was going to
  // pass into another sector within a tick, and was stopped or turned away. Call it before the first question
  // after a tick, and after sectors have come.
  void look_for_strays();
  bool has_strays() const { return !strays_.empty(); }

  // The nearest hit of a ray (`length` in m, `direction` of unit length) in the sectors of this partition.
  // Static bodies count in the sectors that the ray passes through, up to where it has passed through
  // kRayGroundSectorsMax sectors of which the ground may reach up to it. A solid shape is hit where the ray
  // enters it, not where it begins inside; planes, meshes and height fields are hit from both sides.
  std::optional<RayAnswer> raycast(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                   double length, const QueryFilter& filter);

  // The nearest hit of each body on the ray, in ascending order of (distance, body): the first kRayHitsMax of
  // them.
  std::vector<RayAnswer> raycast_all(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                     double length, const QueryFilter& filter);

  // What a convex `probe` touches first that goes from `pose` along a line, without turning: how far it gets,
  // and the normal of the body there, which points to the probe. Exact to 1e-4 m, mostly to 1e-6 m. A probe
  // that overlaps a body by more than 1e-4 m (kSweepTouching) at the start touches it at a distance of 0,
  // whichever way it goes; along what it just touches, it slides, and it may leave it. Meshes and height
  // fields have no inside, and are touched from both sides; planes are solid below. Grounds count as of a
  // ray. `length` as of a ray; the probe must be convex and no larger than a sector.
  std::optional<RayAnswer> sweep(const Geometry& probe, const WorldPose& pose,
                                 const Eigen::Vector3d& direction, double length, const QueryFilter& filter);

  // The bodies of this partition's sectors, and statics in them, within `reach` (m) of a convex `probe` at
  // `pose`, in ascending order of (distance, body).
  std::vector<NearBody> bodies_near(const Geometry& probe, const WorldPose& pose, double reach,
                                    const QueryFilter& filter);

 private:
  // Counts the sectors whose ground may reach up to a line.
  class GroundBudget {
   public:
    explicit GroundBudget(std::size_t max = std::numeric_limits<std::size_t>::max()) : max_(max) {}

    // All servers count alike, so that the answer does not depend on who hosts what.
    bool covers(const Partition& partition, const SectorIndex& index, const Eigen::AlignedBox3d& region);

   private:
    std::size_t max_;
    std::size_t sectors_ = 0;
  };

  const SectorWorld* living_world(const SectorIndex& index);
  bool counts(BodyId body, const WorldLine& line, double radius, const LinePlace& place,
              double distance) const;
  LineWalk past_bodies(const WorldLine& line, double radius) const;
  absl::InlinedVector<LineWalk, 2> past_statics(const WorldLine& line, double radius) const;
  template <typename Ask>
  void ask_along(const WorldLine& line, double radius, GroundBudget budget, const Ask& ask);
  WorldLine line_from(const WorldPosition& origin, const Eigen::Vector3d& direction, double length) const;

  Partition& partition_;
  PassingWorlds passing_;
  std::vector<SectorIndex> strays_;  // the homes of such bodies
};

// Single questions.
std::optional<RayAnswer> raycast(Partition& partition, const WorldPosition& origin,
                                 const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                                 std::span<const BodyId> except = {});
std::vector<RayAnswer> raycast_all(Partition& partition, const WorldPosition& origin,
                                   const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                                   std::span<const BodyId> except = {});
std::optional<RayAnswer> sweep(Partition& partition, const Geometry& probe, const WorldPose& pose,
                               const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                               std::span<const BodyId> except = {});
std::vector<NearBody> bodies_near(Partition& partition, const Geometry& probe, const WorldPose& pose,
                                  double reach, std::uint32_t mask, std::span<const BodyId> except = {});

}  // namespace tessera
