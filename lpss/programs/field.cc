// Field: pushes the dynamic bodies in the triggers of its body: gravity of its own, wind, and what attracts
// or repels.
//
// All of it is given as accelerations, so that bodies of any mass move alike. A dynamic body bears the
// opposite of the radial part, along the line between the two centres of mass: neither momentum nor angular
// momentum comes from nowhere.
#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace field {
namespace {

enum class Parameter { kX, kY, kZ, kWindX, kWindY, kWindZ, kDamping, kDrag, kRadial, kNear, kPower };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m/s^2", 0, -1e4, 1e4, "An acceleration like that of gravity, along the body's x axis,"},
    {"y", "m/s^2", 0, -1e4, 1e4, "along its y axis,"},
    {"z", "m/s^2", 0, -1e4, 1e4, "and along its z axis."},
    {"wind_x", "m/s", 0, -1e3, 1e3, "The velocity of the air, along the body's x axis,"},
    {"wind_y", "m/s", 0, -1e3, 1e3, "along its y axis,"},
    {"wind_z", "m/s", 0, -1e3, 1e3, "and along its z axis."},
    {"damping", "1/s", 0, 0, 1e4, "Linear drag: the acceleration by the velocity of the air past a body."},
    {"drag", "1/m", 0, 0, 1e4,
     "Quadratic drag: that by the square of that velocity, density x coefficient x area / (2 x mass)."},
    {"radial", "m/s^2", 0, -1e6, 1e6,
     "The acceleration away from the centre of mass at the distance `near`; below 0: towards it."},
    {"near", "m", 1, 1e-3, 1e4, "From there on it falls off; nearer, it falls evenly to 0 at the centre."},
    {"power", "", 2, 0, 8, "Of the distance, by which it falls off; 0: not at all."},
});

enum class Input { kStrength };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"strength", "", 1, 0, 1, "Of all of this."},
});

enum class Value { kInside, kLeftOut };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"inside", "", 0, 0, 0, "How many dynamic bodies are in; at most 1,000."},
    {"left_out", "", 0, 0, 0, "1 while there are more: the farthest feel nothing."},
});

constexpr std::size_t kBodiesMax = 1000;
static_assert(kBodiesMax < kProgramFindingsMax && kBodiesMax < kProgramActsMax);

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

// Along the axes of the body.
Eigen::Vector3d along_body(const Senses& senses, Parameter x, Parameter y, Parameter z) {
  return senses.orientation() *
         Eigen::Vector3d(parameter(senses, x), parameter(senses, y), parameter(senses, z));
}

class Field final : public Program {
 public:
  absl::string_view kind() const override { return "field"; }
  absl::string_view summary() const override {
    return "Pushes the dynamic bodies in the triggers of its body: gravity of its own, wind, a magnet.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }
  bool acts_on_others() const override { return true; }

  void ask(const Senses&, std::span<const double>, Asker& asker) const override { asker.visitors(); }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const std::span<const ProgramFinding> found = senses.of(0);
    const std::span<const ProgramFinding> inside = found.first(std::min(found.size(), kBodiesMax));
    at(values, Value::kInside) = static_cast<double>(inside.size());
    at(values, Value::kLeftOut) = found.size() > kBodiesMax ? 1 : 0;
    const double strength = at(senses.inputs, Input::kStrength);
    if (strength == 0 || inside.empty()) return;
    const Eigen::Vector3d uniform = along_body(senses, Parameter::kX, Parameter::kY, Parameter::kZ);
    const Eigen::Vector3d wind = along_body(senses, Parameter::kWindX, Parameter::kWindY, Parameter::kWindZ);
    Eigen::Vector3d reaction = Eigen::Vector3d::Zero();
    for (const ProgramFinding& body : inside) {
      const Eigen::Vector3d radial = body.mass * strength * radial_of(senses, body);
      const Eigen::Vector3d force =
          radial + body.mass * (strength * uniform + drag_of(senses, strength, wind, body));
      reaction -= radial;
      if (!force.isZero(0)) actor.push_other(body.body, force);
    }
    if (senses.properties.motion == Motion::kDynamic && !reaction.isZero(0))
      actor.push_awake(reaction, Eigen::Vector3d::Zero());
    // What is in may begin to move while the own body sleeps.
    actor.wake_in(1);
  }

 private:
  // m/s^2, in the middle of the tick that comes, as leapfrog has it: orbits neither gain nor lose energy, and
  // angular momentum lasts.
  static Eigen::Vector3d radial_of(const Senses& senses, const ProgramFinding& body) {
    const Eigen::Vector3d now = Eigen::Vector3d(body.position.data()) - senses.position();
    const Eigen::Vector3d drift = Eigen::Vector3d(body.velocity.data()) - senses.velocity();
    const Eigen::Vector3d arm = now + drift * (senses.dt / 2);
    const double distance = arm.norm();
    const double most = parameter(senses, Parameter::kRadial);
    if (distance == 0 || most == 0) return Eigen::Vector3d::Zero();
    const double near = parameter(senses, Parameter::kNear);
    const double share = distance <= near
                             ? distance / near
                             : portable::pow(near / distance, parameter(senses, Parameter::kPower));
    return arm * (most * share / distance);
  }

  // m/s^2; at most what takes a body along with the air within a tick.
  static Eigen::Vector3d drag_of(const Senses& senses, double strength, const Eigen::Vector3d& wind,
                                 const ProgramFinding& body) {
    const Eigen::Vector3d past = wind - Eigen::Vector3d(body.velocity.data());
    const double rate =
        parameter(senses, Parameter::kDamping) + parameter(senses, Parameter::kDrag) * past.norm();
    return std::min(strength * rate, 1 / senses.dt) * past;
  }
};

}  // namespace
}  // namespace field

const Program& field_program() {
  static const field::Field kField;
  return kField;
}

}  // namespace tessera
