// Rigid bodies, as described, simulated and sent between servers.
//
// Everything here is plain data. Angles in radians, lengths in metres, masses in kilograms, times in seconds.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/program.h"
#include "lpss/model/seam_policy.h"
#include "lpss/model/shape.h"
#include "lpss/model/surface.h"

namespace tessera {

// The id of a body for its whole life; 0 is no body. Ids are assigned in ascending order and never reused.
struct BodyId {
  std::uint64_t value = 0;

  friend auto operator<=>(const BodyId&, const BodyId&) = default;

  template <typename H>
  friend H AbslHashValue(H h, const BodyId& id) {
    return H::combine(std::move(h), id.value);
  }
};

// The largest integer up to which numbers of JSON and JavaScript are exact.
inline constexpr std::uint64_t kBodyIdMax = (std::uint64_t{1} << 53) - 1;

// Bullet's own worlds, which the policy `clone` and the baseline of experiments run on, order their pairs by
// a 31-bit number; the id itself serves as that number, so that the order is the same in every world that a
// body ever visits.
inline constexpr std::uint64_t kBulletBodyIdMax = std::numeric_limits<std::int32_t>::max() - 1;

constexpr std::uint64_t body_id_max(SeamPolicy seams) {
  return seams == SeamPolicy::kClone ? kBulletBodyIdMax : kBodyIdMax;
}

enum class Motion : std::uint8_t { kStatic, kDynamic, kKinematic };

const char* name_of(Motion motion);  // "static", "dynamic", "kinematic"

// A force (N) and torque (N m) about the centre of mass, in the world's axes.
struct Wrench {
  std::array<double, 3> force{};
  std::array<double, 3> torque{};

  friend bool operator==(const Wrench&, const Wrench&) = default;
};

// What pushes a dynamic body in every tick in which it is awake.
struct LastingForce {
  Wrench wrench;
  bool turns_along = false;  // its axes are those of the body frame
};

// The properties of a body. Its shape, centre frame and assembly never change, nor whether it is static; all
// else may (set_properties()). The *centre frame* of a body has its origin in the centre of mass and its axes
// along the principal axes of inertia: the frame that engines integrate in. States are those of the centre
// frame; clients see the body frame.
struct BodyProperties {
  Motion motion = Motion::kDynamic;
  ShapeId shape = 0;
  double mass = 1;                         // dynamic bodies: > 0; otherwise not used
  std::array<double, 3> inertia{1, 1, 1};  // principal moments about the centre of mass, kg m^2; > 0
  std::array<double, 3> centre{0, 0, 0};   // the centre frame's origin in the body frame
  std::array<double, 4> principal_axes{0, 0, 0, 1};  // rotation from the centre to the body frame, x y z w
  double friction = 0.5;            // Coulomb coefficient; a contact has the smaller of its two
  double restitution = 0;           // 0 to 1; the two of a contact are multiplied
  double linear_damping = 0;        // fraction of the velocity lost per second, 0 to 1
  double angular_damping = 0;       // likewise
  std::uint32_t category = 1;       // collision bits: two bodies collide if each one's category
  std::uint32_t mask = 0xffffffff;  // matches the other one's mask
  bool gravity = true;
  std::uint64_t assembly = 0;           // bodies of one assembly (not 0) do not collide: the links of a model
  std::optional<Surface> surface;       // none: one like any other
  std::optional<LastingForce> lasting;  // none: no force
  bool trigger = false;                 // all parts of its shape are (PartMaterial::trigger)
};

// That of the lasting force, which there is, where the centre frame has this rotation (by rows, to world
// axes).
Wrench wrench_at(const BodyProperties& properties, const std::array<double, 9>& rotation);

// How awake a body is. A body wants to sleep when it has been slow for long enough, and falls asleep when all
// of its island wants to.
enum class Activity : std::uint8_t { kAwake = 1, kAsleep = 2, kWantsSleep = 3 };

struct Velocities {
  std::array<double, 3> linear{};   // m/s
  std::array<double, 3> angular{};  // rad/s
};

// Motion of the centre frame relative to the centre of the home sector, in the world's axes. Exactly the
// numbers that the engine computes with: values of a float engine are stored without rounding. Bodies in free
// flight around a planet have more digits than a float.
struct BodyState {
  std::array<double, 3> position{};                           // m
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // centre frame to world axes, by rows
  std::array<double, 3> linear_velocity{};                    // m/s
  std::array<double, 3> angular_velocity{};                   // rad/s
  double still_for = 0;                                       // s below the sleeping speeds, reduced by slips
  Activity activity = Activity::kAwake;
  // Of a kinematic body, within a tick in which commands change its velocities: those before. From these, its
  // surface comes to the new ones evenly over the tick.
  std::optional<Velocities> velocities_before;
};

// A body as one record, with everything that another sector needs to take it over.
struct BodyRecord {
  BodyId id;
  SectorIndex home;
  BodyProperties properties;
  BodyState state;
  std::vector<ProgramRecord> programs = {};  // none on static bodies
};

// The centre frame's rotation as a unit quaternion, and back.
Eigen::Quaterniond quaternion_of(const BodyState& state);
std::array<double, 9> rotation_of(const Eigen::Quaterniond& q);

// Changes how the surface of a body moves: Surface::velocity and running.
void set_surface_motion(BodyProperties& properties, const std::array<double, 3>& velocity,
                        const std::array<double, 3>& running);

// The centre frame in the body frame.
Pose centre_frame(const BodyProperties& properties);

}  // namespace tessera
