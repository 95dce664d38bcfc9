// Nothing passes through anything: drives, servos, forces and spins against walls, plates and each other.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr int kTrials = 2500;  // of each kind
constexpr int kQuickTrials = 50;
constexpr double kTrialSeconds = 0.5;

// Numbers that are the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : source_(seed) {}
  double within(double low, double high) {
    return low + (high - low) * static_cast<double>(source_() >> 11) * 0x1p-53;
  }
  // Spread evenly over orders of magnitude.
  double scale(double low, double high) { return std::exp(within(std::log(low), std::log(high))); }

 private:
  std::mt19937_64 source_;
};

// One attempt to pass through something, from rest.
struct Trial {
  WorldDescription world;
  Script script;
  std::function<bool(const Glance& mover, const Glance& other)> has_passed;
  std::string other = "mover";
};

// What a wall is hit by, with a gap between them.
struct Meeting {
  double size;       // m, of a cube that moves
  double thickness;  // m, of a wall at x = kPlace
  double gap;        // m
  double mass;       // kg
  double force;      // N

  explicit Meeting(Random& random)
      : size(random.scale(0.02, 0.3)),
        thickness(random.scale(0.01, 0.1)),
        gap(random.within(0, 0.1)),
        mass(random.scale(0.05, 20)),
        force(mass * random.scale(10, 5000)) {}

  double start() const { return kPlace - thickness / 2 - gap - size / 2; }
};

WorldBuilder with_wall(const WorldSettings& settings, const Meeting& meeting) {
  WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
  builder.add("wall", builder.shape(Box{{meeting.thickness, 2, 2}}), 1, {kPlace, 0, 0}, Motion::kStatic);
  add_body(builder, "mover", Box{Vector3d::Constant(meeting.size)}, meeting.mass, {meeting.start(), 0, 0},
           0.5);
  return builder;
}

bool is_beyond_wall(const Glance& mover, const Glance&) { return mover.place.x() > kPlace; }

Trial drive_at_wall(const WorldSettings& settings, Random& random) {
  const Meeting meeting(random);
  WorldBuilder builder = with_wall(settings, meeting);
  builder.tie("slide", JointType::kPrismatic, "", "mover", {meeting.start(), 0, 0}).drives[0] = {
      DriveMode::kEffort, meeting.force};
  return {builder.world(), {}, is_beyond_wall};
}

Trial servo_at_wall(const WorldSettings& settings, Random& random) {
  const Meeting meeting(random);
  WorldBuilder builder = with_wall(settings, meeting);
  JointDescription& slide = builder.tie("slide", JointType::kPrismatic, "", "mover", {meeting.start(), 0, 0});
  const double goal = meeting.gap + meeting.thickness + meeting.size + random.within(0.1, 1);
  const double stiffness = meeting.force / goal;
  slide.drives[0] = {DriveMode::kServo, goal, stiffness, std::sqrt(stiffness * meeting.mass), 0, 0};
  return {builder.world(), {}, is_beyond_wall};
}

// A hinged arm against a plate that stands in its way.
Trial spin_at_plate(const WorldSettings& settings, Random& random) {
  const double width = random.scale(0.02, 0.1);
  const double thickness = random.scale(0.01, 0.05);
  const double angle = random.within(0.12, 1);  // rad
  const double mass = random.scale(0.2, 10);
  WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
  BodyDescription& plate = builder.add(
      "plate", builder.shape(Box{{0.2, thickness, 0.4}}), 1,
      Vector3d(kPlace, 0, 0) + 0.8 * Vector3d(std::cos(angle), std::sin(angle), 0), Motion::kStatic);
  plate.pose.orientation = Eigen::AngleAxisd(angle, Vector3d::UnitZ());
  add_body(builder, "mover", Box{{1, width, width}}, mass, {kPlace + 0.5, 0, 0}, 0.5);
  JointDescription& hinge =
      builder.tie("hinge", JointType::kRevolute, "", "mover", {kPlace, 0, 0}, Vector3d::UnitZ());
  if (random.within(0, 1) < 0.5) {
    hinge.drives[0] = {DriveMode::kVelocity, random.scale(2, 100)};
    hinge.properties.axes[0].effort_max = mass * random.scale(10, 1000);
  } else {
    hinge.drives[0] = {DriveMode::kEffort, mass * random.scale(10, 1000)};
  }
  return {builder.world(), {}, [angle](const Glance& mover, const Glance&) {
            const Vector3d along = mover.turn * Vector3d::UnitX();
            return std::atan2(along.y(), along.x()) > angle || along.x() < -0.5;
          }};
}

// A force on a free body at a wall, or opposite ones on two bodies on a rail: free ones would turn about each
// other.
Trial force_at(const WorldSettings& settings, Random& random) {
  const Meeting meeting(random);
  const bool at_wall = random.within(0, 1) < 0.5;
  const double other_size = random.scale(0.02, 0.3);
  WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
  if (at_wall) {
    builder = with_wall(settings, meeting);
  } else {
    const auto add_on_rail = [&](const std::string& name, double size, double x) {
      add_body(builder, name, Box{Vector3d::Constant(size)}, meeting.mass, {x, 0, 0}, 0.5);
      builder.tie("rail_" + name, JointType::kPrismatic, "", name, {x, 0, 0});
    };
    add_on_rail("mover", meeting.size, kPlace - meeting.gap - meeting.size / 2);
    add_on_rail("other", other_size, kPlace + other_size / 2);
  }
  Trial trial{builder.world(), {}, is_beyond_wall};
  if (!at_wall) {
    trial.other = "other";
    trial.has_passed = [](const Glance& mover, const Glance& other) {
      return mover.place.x() > other.place.x();
    };
  }
  trial.script = [at_wall, force = meeting.force](const Course& course) {
    std::vector<Command> commands{ApplyForce{course.id("mover"), {{force, 0, 0}, {}}}};
    if (!at_wall) commands.emplace_back(ApplyForce{course.id("other"), {{-force, 0, 0}, {}}});
    return commands;
  };
  return trial;
}

using MakeTrial = Trial (*)(const WorldSettings&, Random&);

absl::StatusOr<Results> count_passes(const WorldSettings& settings, const Make& make, MakeTrial make_trial,
                                     int trials) {
  int passed = 0;
  for (int n = 0; n < trials; ++n) {
    Random random(static_cast<std::uint64_t>(n) + 1);
    const Trial trial = make_trial(settings, random);
    const absl::StatusOr<std::unique_ptr<LocalWorld>> local = make(trial.world);
    if (!local.ok()) return local.status();
    Course course(trial.world);
    run(**local, kTrialSeconds, trial.script, course);
    const std::vector<Glance>& movers = course.of("mover");
    const std::vector<Glance>& others = course.of(trial.other);
    bool has_passed = false;
    for (std::size_t tick = 0; tick < movers.size(); ++tick)
      has_passed = has_passed || trial.has_passed(movers[tick], others[tick]);
    passed += has_passed ? 1 : 0;
  }
  return Results{{absl::StrCat("passed of ", trials), "", 0, static_cast<double>(passed), 0}};
}

Scene trials(const std::string& name, MakeTrial make_trial) {
  Scene scene;
  scene.group = "through";
  scene.name = name;
  scene.in_bullet = make_trial != force_at;
  scene.measure = [make_trial](const WorldSettings& settings, const Make& make, bool quick) {
    return count_passes(settings, make, make_trial, quick ? kQuickTrials : kTrials);
  };
  return scene;
}

}  // namespace

std::vector<Scene> through_scenes() {
  return {trials("drives_at_walls", drive_at_wall), trials("servos_at_walls", servo_at_wall),
          trials("spins_at_plates", spin_at_plate), trials("forces_at_walls_and_bodies", force_at)};
}

}  // namespace tessera::truth
