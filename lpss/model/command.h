// Commands: what changes a world from outside of its physics, at the beginning of a tick.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/base/since.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"

namespace tessera {

// What a client asked for, in the order that the sequencer gave it, or a program. Positions are those of the
// centre frame, canonical. describe() passes the fields to what packs, measures or checks them.
struct SpawnBody {
  BodyRecord record;

  static void describe(auto& archive, auto& x) { archive(x.record); }
};
struct RemoveBody {
  BodyId id;
  std::optional<ShapeId> last_of = {};  // a shape that no other body has, which is forgotten

  static void describe(auto& archive, auto& x) { archive(x.id, x.last_of); }
};
struct SetVelocity {
  BodyId id;
  std::array<double, 3> linear{};
  std::array<double, 3> angular{};

  static void describe(auto& archive, auto& x) { archive(x.id, x.linear, x.angular); }
};
struct ApplyImpulse {
  BodyId id;
  std::array<double, 3> impulse{};  // N s
  std::array<double, 3> lever{};    // m, from the centre of mass, world axes

  static void describe(auto& archive, auto& x) { archive(x.id, x.impulse, x.lever); }
};
// For one tick.
struct ApplyForce {
  BodyId id;
  Wrench wrench;

  static void describe(auto& archive, auto& x) { archive(x.id, x.wrench); }
};
// In every tick from this one on, in the place of the force that the body had.
struct SetForce {
  BodyId id;
  std::optional<LastingForce> force;

  static void describe(auto& archive, auto& x) { archive(x.id, x.force); }
};
// At once, without passing the way between; velocities are set too, but for those that are kept. With
// `keeps_rotation` the position is that of the body frame, since where the centre of mass comes to depends on
// how the body is turned. With `keeps_contacts`, a body that stays in its sector keeps the points of its
// contacts, with their impulses, as far as it still touches there; bodies that go to another frame keep those
// with one another.
struct Teleport {
  BodyId id;
  SectorIndex home;
  BodyState state;
  bool keeps_rotation = false;
  bool keeps_linear_velocity = false;
  bool keeps_angular_velocity = false;
  bool keeps_contacts = false;

  static void describe(auto& archive, auto& x) {
    archive(x.id, x.home, x.state, x.keeps_rotation, x.keeps_linear_velocity, x.keeps_angular_velocity,
            x.keeps_contacts);
  }
};
// A kinematic body moves so that it arrives there at the end of this tick; `keeps_rotation` as of a Teleport.
struct KinematicTarget {
  BodyId id;
  SectorIndex home;
  BodyState state;
  bool keeps_rotation = false;

  static void describe(auto& archive, auto& x) { archive(x.id, x.home, x.state, x.keeps_rotation); }
};

// Of the surface of any body, in the body frame: see Surface. What touches it wakes.
struct SetSurfaceMotion {
  BodyId id;
  std::array<double, 3> velocity{};  // m/s
  std::array<double, 3> running{};

  static void describe(auto& archive, auto& x) { archive(x.id, x.velocity, x.running); }
};

// From this tick on, the body has these properties: set_properties(). Of the same shape, centre frame and
// assembly; static if it is, and dynamic if it is the child of a joint.
struct SetProperties {
  BodyId id;
  BodyProperties properties;

  static void describe(auto& archive, auto& x) { archive(x.id, x.properties); }
};

// Every dynamic body whose centre of mass is nearer than `radius` (m) to `centre` (m, from the centre of
// `sector`) and whose category meets `mask` gets an impulse at its centre of mass, away from `centre`: of
// `impulse` (N s; negative: towards it) where it is near, and the less the farther it is, down to 0 at the
// radius. Bodies that commands before this one teleport are where they land. A body in the very centre gets
// none, nor does one that ended the last tick more than a sector outside of its home, as at most those do
// that were stopped short on a way of several sectors a tick.
struct ApplyRadialImpulse {
  SectorIndex sector;
  std::array<double, 3> centre{};
  double radius = 0;
  double impulse = 0;
  std::uint32_t mask = 0xffffffff;

  static void describe(auto& archive, auto& x) { archive(x.sector, x.centre, x.radius, x.impulse, x.mask); }
};

// A joint between bodies of any two sectors.
struct AddJoint {
  JointRecord record;
  std::vector<JointTie> leaders = {};  // of those that its axes follow

  static void describe(auto& archive, auto& x) { archive(x.record, x.leaders); }
};
struct RemoveJoint {
  JointId id;

  static void describe(auto& archive, auto& x) { archive(x.id); }
};
struct SetDrives {
  JointId id;
  JointDrives drives;
  AxisMask axes = kBothAxes;  // that get them; the others keep theirs

  static void describe(auto& archive, auto& x) { archive(x.id, x.drives, since(6, x.axes)); }
};

// A force and torque for one tick that a program has its own body feel; unlike ApplyForce, it wakes nobody.
struct PushBody {
  BodyId id;
  Wrench wrench;

  static void describe(auto& archive, auto& x) { archive(x.id, x.wrench); }
};
inline constexpr std::uint32_t kAllPrograms = ~std::uint32_t{0};

// Sets numbers of a program of a body, which then runs at the end of this tick. Does nothing where the body
// has no such program.
struct TellProgram {
  BodyId id;
  std::uint32_t program = 0;  // its place on the body; or kAllPrograms, which run, and without numbers
  std::vector<std::pair<std::uint32_t, double>> inputs;      // by their places in the program's table
  std::vector<std::pair<std::uint32_t, double>> parameters;  // likewise

  static void describe(auto& archive, auto& x) { archive(x.id, x.program, x.inputs, x.parameters); }
};

using Command = std::variant<SpawnBody, RemoveBody, SetVelocity, ApplyImpulse, ApplyForce, Teleport,
                             KinematicTarget, AddJoint, RemoveJoint, SetDrives, SetSurfaceMotion,
                             SetProperties, ApplyRadialImpulse, SetForce, PushBody, TellProgram>;

}  // namespace tessera
