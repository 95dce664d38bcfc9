// Worlds in which contacts were wrong once ($TESSERA_WORLDS/contact): each moves as the README of that folder
// says, in the sectors that its file asks for and with a border through its middle, and ends in the same bits
// on 1, 2 and 4 servers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "experiments/truth/course.h"
#include "experiments/truth/ray_oracle.h"
#include "lpss/engine/test_world.h"
#include "lpss/observe/queries.h"
#include "lpss/simulation/test_runs.h"
#include "worlds/knobs.h"
#include "worlds/loader/world_file.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kBorder = 8;  // m: with sectors of this size, a border is at x = 4, where most worlds are

struct ContactWorld {
  std::string file;
  double seconds;
  Script script;
  std::function<void(const Course&)> check;
};

// For the names of tests.
void PrintTo(const ContactWorld& contact, std::ostream* out) { *out << contact.file; }

Tick ticks_at(const Course& course, double seconds) {
  return static_cast<Tick>(std::llround(seconds / course.dt()));
}

Script removes(const std::string& body, double at) {
  return [=](const Course& course) -> std::vector<Command> {
    if (course.ticks() != ticks_at(course, at)) return {};
    return {RemoveBody{course.id(body)}};
  };
}

// --- what is right ---

constexpr double kSlip = 1e-4;        // m, after the first second
constexpr double kStandstill = 1e-6;  // m, in the last seconds: of a float's rounding alone

std::function<void(const Course&)> stays(std::vector<std::string> bodies) {
  return [bodies](const Course& course) {
    for (const std::string& body : bodies) {
      EXPECT_LT(way(course, body, 0), 2e-3) << body;
      EXPECT_LE(way(course, body, 1), kSlip) << body;
      EXPECT_LE(way(course, body, course.seconds() - 5), kStandstill) << body;
    }
  };
}

constexpr double kReleased = 1;  // s: what a gripper holds has lost its support

// Fingers (with the sides on which they are) stay outside of what they grip, `reach` (m) between centres, and
// it stays where it is once nothing else holds it.
std::function<void(const Course&)> holds(const std::string& object, double reach,
                                         std::vector<std::pair<std::string, Vector3d>> fingers) {
  return [=](const Course& course) {
    const std::vector<Glance>& held = course.of(object);
    for (const auto& [finger, side] : fingers) {
      const std::vector<Glance>& glances = course.of(finger);
      const auto away = [&](std::size_t n) { return side.dot(glances[n].place - held[n].place); };
      for (std::size_t n = 0; n < glances.size(); ++n)
        ASSERT_GT(away(n), reach - 2e-3) << finger << ", tick " << n;
      EXPECT_NEAR(away(glances.size() - 1), reach, 2e-3) << finger;
    }
    // The two fingers and what they hold may move along their axes together: slip is seen from the fingers.
    const auto seen = [&](std::size_t n) {
      Vector3d middle = Vector3d::Zero();
      for (const auto& [finger, side] : fingers)
        middle += course.of(finger)[n].place / double(fingers.size());
      return Vector3d(held[n].place - middle);
    };
    const auto released = static_cast<std::size_t>(ticks_at(course, kReleased));
    const auto settled = static_cast<std::size_t>(ticks_at(course, kReleased + 1));
    for (std::size_t n = released; n < held.size(); ++n) {
      ASSERT_LT((seen(n) - seen(released)).norm(), 2e-3) << "tick " << n;
      if (n < settled) continue;
      ASSERT_LE((seen(n) - seen(settled)).norm(), kSlip) << "tick " << n;
    }
  };
}

std::function<void(const Course&)> grips() {
  return holds("obj::l", 0.05 + 0.01, {{"g::fl", -Vector3d::UnitX()}, {"g::fr", Vector3d::UnitX()}});
}

std::function<void(const Course&)> stops_at(const std::string& body, double x) {
  return [=](const Course& course) {
    for (const Glance& glance : course.of(body)) ASSERT_LT(glance.place.x(), x + 1e-3);
    EXPECT_NEAR(course.last(body).place.x(), x, 1e-3);
    EXPECT_LT(course.last(body).velocity.norm(), 1e-3);
  };
}

// Speed and height, after a contact that begins with them.
std::function<void(const Course&)> glides(double speed, double distance) {
  return [=](const Course& course) {
    double lowest = 1e9, highest = -1e9;
    for (const Glance& glance : course.between("x::l", 0.2)) {
      ASSERT_NEAR(glance.velocity.x(), speed, 1e-3 * speed) << "at x = " << glance.place.x();
      lowest = std::min(lowest, glance.place.z());
      highest = std::max(highest, glance.place.z());
    }
    EXPECT_LE(highest - lowest, 1e-4);
    EXPECT_NEAR(course.last("x::l").place.z(), 0.15, 1e-3);
    EXPECT_GT(course.last("x::l").place.x(), distance);
  };
}

// Down a slope of 1 in 5 without friction, as it began: along it and without a turn.
void check_field_slope(const Course& course) {
  const double steepness = std::atan(0.2);
  const Vector3d up(std::sin(steepness), 0, std::cos(steepness));
  const Vector3d down(std::cos(steepness), 0, -std::sin(steepness));
  for (const char* body : {"ball::l", "box::l", "capsule::l", "cyl::l"}) {
    const std::vector<Glance>& glances = course.of(body);
    const double start = course.at(body, 0.2).place.dot(up);  // with the overlap that contacts keep
    const bool is_wheel = std::string_view(body) == "cyl::l";
    for (std::size_t n = 0; n < glances.size(); ++n) {
      const double time = static_cast<double>(n) * course.dt();
      const double speed = 5 + 9.81 * std::sin(steepness) * time;
      ASSERT_NEAR(glances[n].place.dot(up), start,
                  time < 0.2 ? 1e-3
                  : is_wheel ? 2e-4
                             : 1e-4)
          << body << " at x = " << glances[n].place.x();
      ASSERT_NEAR(glances[n].velocity.dot(down), speed, 1e-3 * speed)
          << body << " at x = " << glances[n].place.x();
      ASSERT_LT(glances[n].spin.norm(), time < 0.2 ? 1 : 0.02) << body << " at x = " << glances[n].place.x();
    }
    EXPECT_GT(course.last(body).place.x(), 7.5) << body;
  }
}

// The heights (m, above `floor`) to which a body comes back.
std::vector<double> apexes(const Course& course, const std::string& body, double floor) {
  std::vector<double> heights;
  const std::vector<Glance>& glances = course.of(body);
  for (std::size_t n = 1; n + 1 < glances.size(); ++n) {
    const double height = glances[n].place.z();
    if (glances[n - 1].place.z() < height && glances[n + 1].place.z() <= height)
      heights.push_back(height - floor);
  }
  return heights;
}

// To so many of the heights, in their order: velocities to 1 %, and never more energy than before.
std::function<void(const Course&)> bounces(const std::string& body, double floor,
                                           std::vector<double> heights) {
  return [=](const Course& course) {
    const std::vector<double> found = apexes(course, body, floor);
    ASSERT_GE(found.size(), heights.size());
    for (std::size_t n = 0; n < heights.size(); ++n)
      EXPECT_NEAR(found[n], heights[n], 0.02 * heights[n]) << "bounce " << n + 1;
    for (const Glance& glance : course.of(body)) ASSERT_LT(glance.spin.norm(), 0.01);
    EXPECT_LT(energy_gain(course), 1e-3);
  };
}

void check_cue(const Course& course) {
  const Vector3d a = course.last("a::l").velocity;
  const Vector3d b = course.last("b::l").velocity;
  const double across = 1.2 / std::sqrt(3);
  EXPECT_NEAR(course.last("cue::l").velocity.x(), -0.4, 0.012);
  EXPECT_LT((a - Vector3d(1.2, across, 0)).norm(), 0.012) << a.transpose();
  EXPECT_LT((b - Vector3d(1.2, -across, 0)).norm(), 0.012) << b.transpose();
  EXPECT_LT((a - Vector3d(b.x(), -b.y(), b.z())).norm(), 1e-5) << "not symmetric";
  EXPECT_NEAR(course.last("cue::l").velocity.y(), 0, 1e-5);
  EXPECT_LT(energy_gain(course), 1e-3);
}

void check_oblique(const Course& course) {
  const Glance& ball = course.last("ball::l");
  EXPECT_NEAR(ball.velocity.x(), 5 * 5.0 / 7, 0.01 * 3.571);
  EXPECT_NEAR(ball.velocity.z(), 0.8 * 4, 0.032);
  EXPECT_NEAR(ball.spin.y(), 35.71, 0.357);
  EXPECT_LT(energy_gain(course), 1e-3);
}

void check_plate(const Course& course) {
  const Vector3d way = course.last("box::l").place - course.first("box::l").place;
  const double right = 36 / (2 * 0.3 * 9.81);
  EXPECT_LT(std::abs(std::atan2(way.y(), way.x())), 0.1 * pi / 180) << way.transpose();
  EXPECT_NEAR(way.x(), right, 0.005 * right);
  EXPECT_LT(course.last("box::l").velocity.norm(), 1e-3);
}

void check_hinge(const Course& course) {
  // Where the side of the arm meets the near corner of the plate: 0.89 sin x - 0.01 cos x = 0.025.
  const double stop = 0.15 - 0.0393;
  const std::vector<Glance>& glances = course.of("h::arm");
  for (std::size_t n = 0; n < glances.size(); ++n) {
    const Vector3d along = glances[n].turn * Vector3d::UnitX();
    // In the tick of the blow, contacts give way by a quarter of the plate.
    ASSERT_LT(std::atan2(along.y(), along.x()), stop + 0.005 / 0.45) << "tick " << n;
  }
  const Vector3d along = glances.back().turn * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(along.y(), along.x()), stop, 2e-3);
}

std::vector<Command> drive_wagon(const Course& course) {
  const double time = static_cast<double>(course.ticks() + 1) * course.dt();
  return {move_to(course, "wagon::l", {time * time / 2, 0, -0.1})};
}

void check_wagon(const Course& course) {
  const std::vector<Glance>& wagon = course.of("wagon::l");
  const std::vector<Glance>& load = course.of("lone::l");
  const Vector3d start = load[0].place - wagon[0].place;
  for (std::size_t n = 0; n < load.size(); ++n)
    ASSERT_LT((load[n].place - wagon[n].place - start).norm(), 1e-3) << "tick " << n;
}

// To 2 rad/s, within 4 s: 1.226 m from the axis, friction is just enough.
double turn_of_disc(double time) { return time < 4 ? time * time / 4 : 4 + 2 * (time - 4); }

std::vector<Command> drive_disc(const Course& course) {
  const double time = static_cast<double>(course.ticks() + 1) * course.dt();
  return {move_to(course, "disc::l", {4, 0, 0},
                  Eigen::Quaterniond(Eigen::AngleAxisd(turn_of_disc(time), Vector3d::UnitZ())))};
}

void check_disc(const Course& course) {
  const std::vector<Glance>& disc = course.of("disc::l");
  for (const char* body : {"b0::l", "b1::l", "b2::l"}) {
    const std::vector<Glance>& box = course.of(body);
    const auto on_disc = [&](std::size_t n) {
      return disc[n].turn.conjugate() * (box[n].place - disc[n].place);
    };
    for (std::size_t n = 0; n < box.size(); ++n)
      ASSERT_LT((on_disc(n) - on_disc(0)).norm(), 1e-3) << body << ", tick " << n;
  }
  EXPECT_GT((course.last("b5::l").place - disc.back().place).head<2>().norm(), 2.5)
      << "beyond what friction holds";
}

void check_groove(const Course& course) {
  const std::vector<ContactEvent>& events = course.contacts().back();
  Vector3d force = Vector3d::Zero();
  for (const ContactEvent& event : events) {
    EXPECT_NEAR(std::abs(event.normal[0]), std::sqrt(0.5), 1e-3);
    // The normal is on b, pointing to a.
    const double sign = event.a == course.id("ball::l") ? 1 : -1;
    force += sign * event.impulse / course.dt() * Vector3d(event.normal.data());
  }
  EXPECT_EQ(events.size(), 2u) << "a patch each";
  EXPECT_NEAR(force.z(), 2 * 9.81, 0.2);
  EXPECT_NEAR(force.x(), 0, 0.2);
  EXPECT_NEAR(force.y(), 0, 0.2);
}

constexpr double kRemoved = 4;     // s: both sleep
constexpr double kTeleported = 8;  // s: the other one does, again

std::vector<Command> end_contacts(const Course& course) {
  if (course.ticks() == ticks_at(course, kRemoved)) return {RemoveBody{course.id("rm::l")}};
  if (course.ticks() != ticks_at(course, kTeleported)) return {};
  Teleport away{course.id("tp::l"), {}, {}};
  away.state.position = {2, 2, 2};
  return {away};
}

void check_ends(const Course& course) {
  for (const auto& [body, time] : {std::pair("rm::l", kRemoved), std::pair("tp::l", kTeleported)}) {
    EXPECT_TRUE(course.at(body, time).asleep) << body;
    const auto ends = [&, id = course.id(body)](const ContactEvent& event) {
      return event.phase == ContactPhase::kEnd && (event.a == id || event.b == id);
    };
    EXPECT_TRUE(std::ranges::any_of(course.contacts()[ticks_at(course, time)], ends)) << body;
  }
}

void check_on_mesh(const Course& course) {
  EXPECT_NEAR(course.last("b::l").place.z(), 0.05, 1e-3);
  EXPECT_LT(course.last("b::l").velocity.norm(), 1e-3);
}

void check_cart(const Course& course) {
  EXPECT_NEAR(course.last("car::chassis").place.z(), 0.25, 2e-3);
  for (const char* wheel : {"car::w0", "car::w1", "car::w2", "car::w3"}) {
    for (const Glance& glance : course.of(wheel)) ASSERT_GT(glance.place.z(), 0.098) << wheel;
  }
}

// Lifting one out of the other takes 25 J.
void check_pallets(const Course& course) {
  for (const char* pallet : {"p0::link", "p1::link"}) {
    for (const Glance& glance : course.of(pallet)) ASSERT_LT(glance.velocity.norm(), 1.5) << pallet;
  }
}

std::vector<ContactWorld> contact_worlds() {
  return {
      {"contact/hold_slope_joint_80.sdf", 15, {}, stays({"car::foot", "car::top"})},
      {"contact/hold_slope_joint_8.sdf", 15, {}, stays({"car::foot", "car::top"})},
      {"contact/level_two.sdf", 30, {}, stays({"car::foot", "car::top"})},
      {"contact/park_fixed_box_M20.sdf", 15, {}, stays({"car::chassis", "car::w_fl", "car::w_rr"})},
      {"contact/grip_1kg.sdf", 16, removes("block::l", kReleased), grips()},
      {"contact/grip_1kg_gap1cm_F30.sdf", 16, removes("block::l", kReleased), grips()},
      {"contact/actuator_effort_30_0.2_10.sdf", 2, {}, stops_at("a::p", 3.99)},
      {"contact/actuator_effort_1000_1_50.sdf", 2, {}, stops_at("a::p", 3.99)},
      {"contact/hinge_hits_20_50.sdf", 3, {}, check_hinge},
      {"contact/ghost_tiles_box_1.sdf", 9, {}, glides(1, 10)},
      {"contact/ghost_tiles_box_8.sdf", 1.1, {}, glides(8, 10)},
      {"contact/ghost_tiles_ball_8.sdf", 1.1, {}, glides(8, 10)},
      {"contact/ghost_one_link_box_3.sdf", 3, {}, glides(3, 10)},
      {"contact/seams_static_hfslope.sdf", 1.1, {}, check_field_slope},
      {"contact/bounce_box_pedestal.sdf", 3, {}, bounces("box::l", 1.5, {1, 1})},
      {"contact/bounce_box_plane_half.sdf", 2, {}, bounces("box::l", 0.5, {0.25, 0.0625})},
      {"contact/cue_two.sdf", 1, {}, check_cue},
      {"contact/bounce_oblique_slip_e8.sdf", 0.25, {}, check_oblique},
      {"contact/slide_angle_plate_45.sdf", 3, {}, check_plate},
      {"contact/wagon_accelerates.sdf", 5, drive_wagon, check_wagon},
      {"contact/turntable_boxes.sdf", 10, drive_disc, check_disc},
      {"contact/impulse_groove1.sdf", 3, {}, check_groove},
      {"contact/bounce_asteroid.sdf", 30, {}, bounces("ball::l", 0.1, {0.81})},
      {"contact/events_sleeping.sdf", 9, end_contacts, check_ends},
      {"contact/obj_dotfive.sdf", 1, {}, check_on_mesh},
      {"files/01_light_wheels_sink.sdf", 5, {}, check_cart},
      {"files/03_overlapping_pallets_explode.sdf", 3, {}, check_pallets},
      {"files/04_pad_beside_centre.sdf", 10, removes("pedestal::l", kReleased),
       holds("cube::l", 0.025 + 0.01,
             {{"hand::left", Vector3d::UnitY()}, {"hand::right", -Vector3d::UnitY()}})},
  };
}

// By the world and the size of sectors (m); 0: that of the file.
class ContactWorlds : public testing::TestWithParam<std::tuple<ContactWorld, double>> {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TESSERA_WORLDS");
    if (folder == nullptr) GTEST_SKIP() << "TESSERA_WORLDS is not set";
    folder_ = folder;
  }

  LoadedWorld load(const std::string& file) const {
    absl::StatusOr<LoadedWorld> loaded = load_world_file(folder_ / file);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    if (!loaded.ok()) return {};
    loaded->world.settings.precision = engine_tests::test_precision;
    return *std::move(loaded);
  }
  static WorldDescription with_sectors(WorldDescription world, double size) {
    if (size > 0) {
      EXPECT_EQ(change_sector_size(world, size), absl::OkStatus());
    }
    return world;
  }

  std::filesystem::path folder_;
};

TEST_P(ContactWorlds, MovesAsItShould) {
  const auto& [contact, size] = GetParam();
  const WorldDescription world = with_sectors(load(contact.file).world, size);
  ASSERT_FALSE(world.bodies.empty());
  const auto contestant = in_sectors(world);
  ASSERT_TRUE(contestant.ok()) << contestant.status();
  Course course(world);
  run(**contestant, contact.seconds, contact.script, course, /*keeps_contacts=*/true);
  EXPECT_EQ(course.diverged(), 0u);
  contact.check(course);
}

TEST_P(ContactWorlds, EndsInTheSameBitsOnAnyNumberOfServers) {
  const auto& [contact, size] = GetParam();
  WorldDescription world = with_sectors(load(contact.file).world, size);
  ASSERT_FALSE(world.bodies.empty());
  std::vector<std::unique_ptr<PartitionCluster>> clusters;
  for (const std::uint32_t partitions : {1u, 2u, 4u}) {
    clusters.push_back(cluster_of(world, partitions));
    world.settings.shuffle = 7 + partitions;
  }
  Course course(world);  // of the first of them
  const auto one = in_sectors(world);
  ASSERT_TRUE(one.ok());
  course.look((*one)->bodies());
  const Tick ticks = ticks_at(course, std::min(contact.seconds, 6.0));
  while (course.ticks() < ticks) {
    const std::vector<Command> commands = contact.script ? contact.script(course) : std::vector<Command>();
    for (const auto& cluster : clusters) cluster->step(commands);
    (*one)->step(commands);
    course.end_tick(**one, false);
    for (const auto& cluster : clusters)
      ASSERT_EQ(cluster->hash(), clusters.front()->hash())
          << cluster->size() << " servers, tick " << course.ticks();
  }
}

std::string name_of_case(const testing::TestParamInfo<ContactWorlds::ParamType>& info) {
  std::string name = std::filesystem::path(std::get<0>(info.param).file).stem().string();
  std::ranges::replace(name, '.', '_');
  return name + (std::get<1>(info.param) > 0 ? "_border" : "");
}

INSTANTIATE_TEST_SUITE_P(Contact, ContactWorlds,
                         testing::Combine(testing::ValuesIn(contact_worlds()), testing::Values(0, kBorder)),
                         name_of_case);

// --- what is no course ---

class ContactFiles : public ContactWorlds {};

TEST_P(ContactFiles, RaysMeetConvexBodiesWhereTheyAre) {
  constexpr int kRays = 4000;
  const double size = std::get<1>(GetParam());
  const WorldDescription world = with_sectors(load("contact/rays_convex.sdf").world, size);
  ASSERT_EQ(world.bodies.size(), 7u);
  const auto cluster = cluster_of(world, 1);
  const double tolerance = engine_tests::test_precision == Precision::kFloat32 ? 1e-5 : 1e-9;
  std::mt19937_64 random(4711);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> distance(1.2, 6);
  for (std::size_t n = 0; n < world.bodies.size(); ++n) {
    SCOPED_TRACE(world.bodies[n].name);
    const Geometry& geometry = world.shapes[world.bodies[n].properties.shape].parts.front().geometry;
    const RayOracle right(geometry), smaller(geometry, -tolerance), larger(geometry, tolerance);
    const Vector3d centre =
        relative_to(world.bodies[n].pose.position, world.anchor, world.settings.sector_size);
    double worst = 0, worst_angle = 0;
    int wrong = 0;
    for (int ray = 0; ray < kRays; ++ray) {
      const Vector3d from =
          distance(random) * Vector3d(normal(random), normal(random), normal(random)).normalized();
      const Vector3d to = 0.4 * Vector3d(normal(random), normal(random), normal(random));
      const Vector3d direction = (to - from).normalized();
      // Nothing else is in the way: bodies are 4 m apart, and 1 m large.
      const absl::StatusOr<WorldPosition> origin =
          canonical(world.anchor, centre + from, world.settings.sector_size);
      ASSERT_TRUE(origin.ok());
      const std::optional<RayAnswer> got = raycast(cluster->partition(0), *origin, direction, 10, 0xffffffff);
      const bool is_hit = got && got->body == BodyId{n + 1};
      if (got && !is_hit) continue;
      if (is_hit ? !larger.distance(from, direction) : smaller.distance(from, direction).has_value()) ++wrong;
      const std::optional<double> answer = right.distance(from, direction);
      if (!is_hit || !answer) continue;
      const Vector3d point = from + *answer * direction;
      worst = std::max(worst, std::abs(got->distance - *answer) * std::abs(got->normal.dot(direction)));
      worst_angle = std::max(worst_angle, right.normal_error(point, got->normal, 10 * tolerance));
    }
    EXPECT_EQ(wrong, 0) << "hit or missed by more than rounding";
    EXPECT_LT(worst, tolerance) << "m";
    EXPECT_LT(worst_angle, 1e3 * tolerance) << "rad";
  }
}

TEST_P(ContactFiles, DirectionsOfFrictionInOtherFramesAreTold) {
  const LoadedWorld loaded = load("contact/sdf_features.sdf");
  const auto tells = [](const std::string& line) {
    return line.find("expressed_in") != std::string::npos || line.find("fdir1") != std::string::npos;
  };
  EXPECT_TRUE(std::ranges::any_of(loaded.notices, tells) || std::ranges::any_of(loaded.repairs, tells))
      << testing::PrintToString(loaded.notices);
}

INSTANTIATE_TEST_SUITE_P(Contact, ContactFiles,
                         testing::Combine(testing::Values(ContactWorld()), testing::Values(0, kBorder)),
                         [](const auto& of) { return std::get<1>(of.param) > 0 ? "border" : "one"; });

}  // namespace
}  // namespace tessera::truth
