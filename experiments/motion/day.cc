#include "experiments/motion/day.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/motion/fall.h"
#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPlanetRadius = 6.371e6;  // m
constexpr double kPlanetPull = 9.81;       // m/s^2, on its surface
constexpr double kStationHeight = 4e5;     // m
constexpr double kDaySector = 16384;       // m
constexpr int kTicksASecond = 60;
constexpr double kCalm = 600;               // s, until the ship is there
constexpr double kComes = 0.05;             // m/s, as it does
constexpr double kDocked = 10.3;            // m, from centre to centre
constexpr double kPushesOff = 0.6;          // m/s
constexpr int kRests = 20;                  // s, between two pushes of somebody
constexpr double kWallOfCabin = 1;          // m
const Vector3d kBallStarts(0.3, 0.2, 0.5);  // m, from the centre of the station
constexpr BodyId kStation{1};
constexpr BodyId kShip{2};
constexpr JointId kDock{1};

struct Cabin {
  FrameNumber frame;
  BodyId hull;
  Vector3d size;  // m
};

const std::array<Cabin, 2>& cabins() {
  static const std::array<Cabin, 2> all = {{{1, kStation, {10, 4, 4}}, {2, kShip, {6, 3, 3}}}};
  return all;
}

struct Crew {
  std::string name;
  FrameNumber frame;
  Vector3d place;
  double mass;
};

// In the order of their ids, from 3 on.
const std::vector<Crew>& crew() {
  static const std::vector<Crew> all = {{"first", 1, {-3, 0.5, 0.3}, 80},
                                        {"second", 1, {3.5, -0.8, -0.5}, 70},
                                        {"third", 1, {-1, -1, 0.8}, 90},
                                        {"pilot", 2, {1.5, 0.3, -0.4}, 75},
                                        {"cargo", 2, {-1.2, -0.4, 0.2}, 400}};
  return all;
}

constexpr BodyId kBall{8};

void add_walls(WorldBuilder& builder, const Cabin& cabin) {
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d size = cabin.size + Vector3d::Constant(2 * kWallOfCabin);
    size[axis] = kWallOfCabin;
    const ShapeId wall = builder.shape(Box{size});
    for (const int side : {-1, 1}) {
      Vector3d place = Vector3d::Zero();
      place[axis] = side * (cabin.size[axis] + kWallOfCabin) / 2;
      BodyDescription& body =
          builder.add(absl::StrCat("wall", cabin.frame, std::string(1, "xyz"[axis]), side > 0 ? "+" : "-"),
                      wall, 1, place, Motion::kStatic);
      body.pose.position.sector.frame = cabin.frame;
    }
  }
}

MovingFrame frame_of(const Cabin& cabin) {
  MovingFrame frame;
  frame.name = cabin.hull == kStation ? "station" : "ship";
  frame.carrier = FrameCarrier{cabin.hull, {}};
  frame.region = FrameRegion{Vector3d::Zero(), cabin.size + Vector3d::Constant(kWallOfCabin)};
  return frame;
}

struct Meeting {
  CentralGravity planet;
  FallingPoint station;
  FallingPoint ship;  // as seen from the station
};

// The ship starts where it reaches its place beside the station after kCalm: integrated back from there.
Meeting meeting() {
  Meeting meeting;
  const Vector3d up = Vector3d(2, -1, 2) / 3;
  meeting.station.place = up * (kPlanetRadius + kStationHeight);
  const double strength = kPlanetPull * kPlanetRadius * kPlanetRadius;
  meeting.station.velocity =
      Vector3d(1, 2, 0).normalized() * std::sqrt(strength / meeting.station.place.norm());
  meeting.planet.surface = kPlanetPull;
  meeting.planet.radius = kPlanetRadius;
  meeting.planet.centre = *canonical({}, -meeting.station.place, kDaySector);
  const FallingPoint then = fallen(meeting.planet, meeting.station, kCalm);
  meeting.ship = fallen_beside(meeting.planet, then, {{kDocked, 0, 0}, {-kComes, 0, 0}}, -kCalm);
  return meeting;
}

WorldDescription station_and_ship(const ExperimentOptions& options, const Meeting& meeting) {
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kDaySector;
  settings.time_step = 1.0 / kTicksASecond;
  settings.gravity = meeting.planet;
  settings.sleep_after = 0;  // what floats drifts, however slowly
  for (const Cabin& cabin : cabins()) settings.frames.push_back(frame_of(cabin));
  WorldBuilder builder(settings);
  builder.add("station", builder.shape(Box{{12, 6, 6}}), 20000, Vector3d::Zero()).linear_velocity =
      meeting.station.velocity;
  builder.add("ship", builder.shape(Box{{8, 5, 5}}), 8000, meeting.ship.place).linear_velocity =
      meeting.station.velocity + meeting.ship.velocity;
  const ShapeId person = builder.shape(Capsule{0.25, 0.9});
  const ShapeId crate = builder.shape(Box{{1, 0.8, 0.6}});
  for (const Crew& member : crew()) {
    const ShapeId shape = member.name == "cargo" ? crate : person;
    builder.add(member.name, shape, member.mass, member.place).pose.position.sector.frame = member.frame;
  }
  builder.add("ball", builder.shape(Sphere{0.1}), 2, kBallStarts).pose.position.sector.frame = 1;
  for (const Cabin& cabin : cabins()) add_walls(builder, cabin);
  place_carried(builder.world());
  return builder.world();
}

// All bodies together, seen from outside.
struct Whole {
  double mass = 0;                   // kg
  FallingPoint centre;               // of mass
  Vector3d spin = Vector3d::Zero();  // kg m^2/s, about it
  std::vector<FallingMass> parts;
};

struct SeenBody {
  BodyRecord record;  // in its frame
  FramedBody outside;
};

std::vector<SeenBody> see_all(const Simulation& simulation) {
  const Partition& partition = simulation.partition();
  std::vector<SeenBody> seen;
  simulation.for_each_body([&](const BodyRecord& body) {
    const FramedBody here{body.home, body.state};
    const FrameNumber frame = body.home.frame;
    if (frame == kWorldFrame) {
      seen.push_back({body, here});
      return;
    }
    const FramePlace& place = partition.carried[frame - 1].place;
    seen.push_back({body, *out_of_frame(place, here, partition.sector_size())});
  });
  return seen;
}

Vector3d from_planet(const CentralGravity& planet, const FramedBody& body) {
  return metres_from(planet, {body.home, Vector3d(body.state.position.data())}, kDaySector);
}

// m, exactly for what is near each other.
Vector3d between(const FramedBody& from, const FramedBody& to) {
  return metres_between(from.home, to.home, kDaySector) +
         (Vector3d(to.state.position.data()) - Vector3d(from.state.position.data()));
}

Whole whole_of(const Simulation& simulation, const CentralGravity& planet,
               const std::vector<SeenBody>& bodies) {
  Whole whole;
  const FramedBody& first = bodies.front().outside;
  Vector3d centre = Vector3d::Zero();  // from the first one
  Vector3d momentum = Vector3d::Zero();
  for (const SeenBody& body : bodies) {
    const double mass = body.record.properties.mass;
    whole.mass += mass;
    centre += mass * between(first, body.outside);
    momentum += mass * Vector3d(body.outside.state.linear_velocity.data());
  }
  centre /= whole.mass;
  // Carriers are still to get that of what is aboard; as much again is on its way to them, since half of it
  // is given in each tick.
  for (const Cabin& cabin : cabins()) {
    const CarriedFrame& carried = simulation.partition().carried[cabin.frame - 1];
    const Vector3d place = between(first, bodies[cabin.hull.value - 1].outside) - centre;
    momentum += 2 * carried.owed;
    whole.spin += 2 * (carried.owed_spin + place.cross(carried.owed));
  }
  whole.centre = {from_planet(planet, first) + centre, momentum / whole.mass};
  for (const SeenBody& body : bodies) {
    const BodyState& state = body.outside.state;
    const double mass = body.record.properties.mass;
    const Vector3d place = between(first, body.outside) - centre;
    const Vector3d velocity = Vector3d(state.linear_velocity.data()) - whole.centre.velocity;
    const Eigen::Matrix3d axes = quaternion_of(state).toRotationMatrix();
    const Vector3d moments(body.record.properties.inertia.data());
    whole.spin += mass * place.cross(velocity) +
                  axes * moments.asDiagonal() * axes.transpose() * Vector3d(state.angular_velocity.data());
    whole.parts.push_back({mass / whole.mass, place});
  }
  return whole;
}

struct Errors {
  double place = 0;     // m
  double momentum = 0;  // of the whole momentum
  double spin = 0;      // kg m^2/s
  double gap = 0;       // m
  double turn = 0;      // rad
  double drift = 0;     // m, of the ball
};

class Day {
 public:
  Day(const Meeting& meeting, std::unique_ptr<Simulation> simulation)
      : meeting_(meeting), simulation_(std::move(simulation)) {
    bodies_ = see_all(*simulation_);
    right_ = whole_of(*simulation_, meeting_.planet, bodies_);
    now_ = right_;
    ball_ = {between(outside(kStation), outside(kBall)), Vector3d::Zero()};
    station_ = meeting_.station;
  }

  // One second, of the world and of the reference.
  void go_on() {
    std::vector<Command> commands;
    if (docked_ == 0 && between(outside(kStation), outside(kShip)).norm() < kDocked + 1e-3) dock(commands);
    if (docked_ > 0) push_off(commands);
    step_us_ += processor_us([&] {
      simulation_->step(commands);
      for (int tick = 1; tick < kTicksASecond; ++tick) simulation_->step();
    });
    ++seconds_;
    bodies_ = see_all(*simulation_);
    compare();
    if (docked_ == 0) watch_ball();
  }

  int seconds() const { return seconds_; }
  const Errors& worst() const { return worst_; }
  Row docking() const {
    const double ticks = static_cast<double>(seconds_) * kTicksASecond;
    return {{"ticks", ticks},    {"tick_us", step_us_ / ticks},
            {"docked", docked_}, {"speed", docking_speed_},
            {"spin", spin_},     {"pushes", pushes_}};
  }
  bool is_docked() const { return docked_ > 0; }
  double largest_spin() const { return spin_; }

 private:
  const FramedBody& outside(BodyId id) const { return bodies_[id.value - 1].outside; }
  static Pose pose_of(const FramedBody& body, const FramedBody& from) {
    return {between(from, body), quaternion_of(body.state)};
  }

  // They are held as they are to each other now.
  void dock(std::vector<Command>& commands) {
    const Pose station = pose_of(outside(kStation), outside(kStation));
    const Pose ship = pose_of(outside(kShip), outside(kStation));
    const Pose port{ship.position / 2, station.orientation};
    AddJoint joint;
    joint.record.id = kDock;
    joint.record.parent_motion = Motion::kDynamic;
    JointProperties& properties = joint.record.properties;
    properties.type = JointType::kFixed;
    properties.parent = kStation;
    properties.child = kShip;
    properties.in_parent = in_station_ = station.inverse() * port;
    properties.in_child = in_ship_ = ship.inverse() * port;
    commands.push_back(joint);
    docked_ = std::max(seconds_, 1);
    docking_speed_ = (Vector3d(outside(kShip).state.linear_velocity.data()) -
                      Vector3d(outside(kStation).state.linear_velocity.data()))
                         .norm();
  }

  // Everyone at another time, to one side and another: the hull gets the opposite push, where they are.
  void push_off(std::vector<Command>& commands) {
    for (std::size_t n = 0; n < crew().size(); ++n) {
      const Crew& member = crew()[n];
      if (member.name == "cargo" || (seconds_ + 4 * static_cast<int>(n)) % kRests != 0) continue;
      const BodyId id{3 + n};
      const double turn = 2.399963 * pushes_;  // rad: the golden angle
      const double height = std::remainder(0.618034 * pushes_, 1) * 2;
      const double flat = std::sqrt(1 - height * height);
      const Vector3d way(flat * std::cos(turn), flat * std::sin(turn), height);
      const Vector3d impulse = member.mass * kPushesOff * way;
      const BodyId hull = cabins()[member.frame - 1].hull;
      const Vector3d back = -(simulation_->partition().carried[member.frame - 1].place.orientation * impulse);
      const Vector3d lever = between(outside(hull), outside(id));
      commands.push_back(ApplyImpulse{id, {impulse.x(), impulse.y(), impulse.z()}, {}});
      commands.push_back(
          ApplyImpulse{hull, {back.x(), back.y(), back.z()}, {lever.x(), lever.y(), lever.z()}});
      ++pushes_;
    }
  }

  void compare() {
    const Whole before = std::exchange(now_, whole_of(*simulation_, meeting_.planet, bodies_));
    const Vector3d torque_before = torque_on(meeting_.planet, right_.centre.place, before.parts);
    right_.centre = fallen(meeting_.planet, right_.centre, 1, before.parts);
    const Vector3d torque = torque_on(meeting_.planet, right_.centre.place, now_.parts);
    right_.spin += (torque_before + torque) / 2 * right_.mass;
    const auto take = [](double error, double& worst) { worst = std::max(worst, error); };
    take((now_.centre.place - right_.centre.place).norm(), worst_.place);
    take((now_.centre.velocity - right_.centre.velocity).norm() / right_.centre.velocity.norm(),
         worst_.momentum);
    take((now_.spin - right_.spin).norm(), worst_.spin);
    if (docked_ == 0) return;
    take(now_.spin.norm(), spin_);
    const Pose there = pose_of(outside(kStation), outside(kStation)) * in_station_;
    const Pose here = pose_of(outside(kShip), outside(kStation)) * in_ship_;
    take((here.position - there.position).norm(), worst_.gap);
    take(rotation_vector(here.orientation * there.orientation.conjugate()).norm(), worst_.turn);
  }

  // It floats in a station that falls.
  void watch_ball() {
    const FallingPoint station = fallen(meeting_.planet, station_, 1);
    ball_ = fallen_beside(meeting_.planet, station_, ball_, 1);
    station_ = station;
    worst_.drift = std::max(worst_.drift, (between(outside(kStation), outside(kBall)) - ball_.place).norm());
  }

  Meeting meeting_;
  std::unique_ptr<Simulation> simulation_;
  std::vector<SeenBody> bodies_;
  Whole right_;
  Whole now_;
  FallingPoint station_;
  FallingPoint ball_;
  Pose in_station_;
  Pose in_ship_;
  Errors worst_;
  int seconds_ = 0;
  int docked_ = 0;  // s
  int pushes_ = 0;
  double docking_speed_ = 0;
  double spin_ = 0;
  double step_us_ = 0;
};

// What a day, or a part of it, is held to.
void check(const Day& day, Report& report) {
  struct Kept {
    std::string quantity;
    std::string unit;
    double got;
    double bound;
  };
  const Errors& worst = day.worst();
  const Kept all[] = {
      {"centre of mass off its place", "m", worst.place, 30},
      {"momentum", "of it", worst.momentum, 5e-6},
      {"angular momentum", "of the largest", worst.spin / day.largest_spin(), 2e-3},
      {"gap of the joint", "m", worst.gap, 1e-6},
      {"angle of the joint", "rad", worst.turn, 1e-9},
      {"ball off its place", "m", worst.drift, 1e-4},
  };
  for (const Kept& kept : all) {
    const bool is_ok = kept.got <= kept.bound;
    report.table("kept").push_back({{"quantity", kept.quantity},
                                    {"unit", kept.unit},
                                    {"got", kept.got},
                                    {"bound", kept.bound},
                                    {"ok", is_ok}});
    if (!is_ok)
      report.misses.push_back(absl::StrCat("a day in orbit, ", kept.quantity, ": ", kept.got, " ", kept.unit,
                                           ", at most ", kept.bound));
  }
}

}  // namespace

absl::StatusOr<Report> measure_day(const ExperimentOptions& options) {
  Report report;
  if (options.precision != Precision::kFloat64) return report;
  const Meeting meeting = tessera::meeting();
  absl::StatusOr<std::unique_ptr<Simulation>> simulation =
      Simulation::create(station_and_ship(options, meeting));
  if (!simulation.ok()) return simulation.status();
  Day day(meeting, *std::move(simulation));
  const int seconds = options.quick ? 1200 : 86400;
  const int every = options.quick ? 60 : 3600;
  while (day.seconds() < seconds) {
    day.go_on();
    if (day.seconds() % every != 0) continue;
    const Errors& worst = day.worst();
    report.table("day").push_back({{"hours", day.seconds() / 3600.0},
                                   {"place", worst.place},
                                   {"momentum", worst.momentum},
                                   {"spin", worst.spin},
                                   {"gap", worst.gap},
                                   {"turn", worst.turn}});
  }
  report.table("docking").push_back(day.docking());
  if (!day.is_docked()) report.misses.push_back("the ship has not come to the station");
  check(day, report);
  return report;
}

}  // namespace tessera
