#include <absl/strings/match.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "lpss/programs/registry.h"

namespace tessera {
namespace {

TEST(Programs, AscendByKindAndHaveTablesOfTheirOwn) {
  EXPECT_TRUE(std::ranges::is_sorted(programs(), {}, &Program::kind));
  for (const Program* program : programs()) {
    EXPECT_EQ(find_program(program->kind()), program);
    std::vector<absl::string_view> names;
    for (const auto table : {program->parameters(), program->inputs()}) {
      EXPECT_LE(table.size(), kProgramNumbersMax);
      for (const NumberSpec& spec : table) {
        names.push_back(spec.name);
        EXPECT_LE(spec.least, spec.first) << program->kind() << " " << spec.name;
        EXPECT_LE(spec.first, spec.most) << program->kind() << " " << spec.name;
        EXPECT_FALSE(spec.meaning.empty());
      }
    }
    std::ranges::sort(names);
    EXPECT_EQ(std::ranges::adjacent_find(names), names.end()) << program->kind();
  }
}

TEST(Programs, UnknownKindsAreNamedWithThoseThatThereAre) {
  const auto record = new_program("walker");
  EXPECT_EQ(record.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(record.status().message(),
            "there is no program \"walker\"; there are: ackermann, altimeter, barometer, belt, breaker,"
            " camera, character, diff_drive, field, floater, hydrodynamics, imu, load, logical_camera, "
            "magnetometer, "
            "motorcycle, mover, multicopter, pad, pid, portal, pose, ranger, relay, satellite, thruster, "
            "touch, tracks, trajectory, treads, vehicle, velocity_control, wander, waypoints, wind, wing");
}

// A snapshot, which has what programs do in the next tick, can be restored.
TEST(Programs, AreStoppedForWhatASnapshotCannotHave) {
  BodyProperties properties;
  properties.motion = Motion::kKinematic;
  const BodyState state;
  const Senses senses{.body = BodyId{1},
                      .properties = properties,
                      .state = state,
                      .gravity = Eigen::Vector3d::Zero(),
                      .start = Eigen::Vector3d::Zero()};
  const auto fault_of = [&](const auto& act) {
    std::vector<Command> commands;
    std::uint64_t wake_at = 0;
    std::string fault;
    Actor actor(senses, 128, commands, wake_at, fault);
    act(actor);
    EXPECT_EQ(commands.empty(), !fault.empty());
    return fault;
  };
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const Eigen::Vector3d endless = Eigen::Vector3d::Constant(HUGE_VAL);
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.move_to({0, -1e4, 0}); }), "");
  EXPECT_EQ(fault_of([&](Actor& actor) {
              actor.move_to({0, -10001, 0});
            }),
            "it moves its body farther than 10000 m in a tick");
  const std::string not_finite = "what it does is not finite";
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.move_to(endless); }), not_finite);
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.push(none, endless); }), not_finite);
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.push_awake(endless, none); }), not_finite);
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.move_surface(BodyId{2}, none, endless); }), not_finite);
  EXPECT_EQ(fault_of([&](Actor& actor) {
              actor.move_surface(BodyId{2}, {0, 1001, 0}, none);
            }),
            "it moves a surface faster than 1000 m/s");
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.push_other(BodyId{2}, endless); }), not_finite);
  EXPECT_EQ(fault_of([&](Actor& actor) { actor.impulse(BodyId{2}, none, endless); }), not_finite);
}

TEST(Programs, NumbersOutOfBoundsAreRefused) {
  BodyProperties body;
  ProgramRecord record = *new_program("character");
  EXPECT_TRUE(check_programs(body, {&record, 1}, {}).ok());
  record.parameters[0] = -1;
  EXPECT_EQ(check_programs(body, {&record, 1}, {}).message(),
            "program character: height = -1 m must be at least 0.01 m");
}

// Each number of each program, one at a time.
TEST(Programs, AnyNumberIsTakenOrRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Program* program : programs()) {
    for (const auto table : {program->parameters(), program->inputs()}) {
      for (const NumberSpec& spec : table) {
        for (const double value : {0.0, 0.5, -1.0, 1e18, -1e300, HUGE_VAL, kNan, spec.least, spec.most}) {
          ProgramRecord record = *new_program(program->kind());
          ASSERT_TRUE(set_number(record, spec.name, value).ok());
          const absl::Status status = check_programs(BodyProperties{}, {&record, 1}, {});
          const std::string title = std::string(program->kind()) + ": " + std::string(spec.name);
          EXPECT_EQ(status.ok(), check_number(spec, value).ok()) << title << " = " << value;
          EXPECT_TRUE(status.ok() || absl::StartsWith(status.message(), "program " + title + " = "))
              << status;
        }
      }
    }
  }
}

TEST(Programs, NewOnesAreForBodiesThatTheyCanWorkOn) {
  WorldDescription world;
  world.bodies.resize(2);
  world.bodies[1].name = "lift";
  world.bodies[1].properties.motion = Motion::kKinematic;
  world.bodies[1].programs = {*new_program("mover"), *new_program("pad")};
  EXPECT_TRUE(check_programs(world).ok());
  world.bodies[1].programs[1].parameters[0] = 3;
  EXPECT_EQ(check_programs(world).message(),
            "body \"lift\": program pad: body = 3 must be at most 2, the number of bodies");
  world.bodies[1].programs[1].parameters[0] = 1.5;
  EXPECT_EQ(check_programs(world).message(),
            "body \"lift\": program pad: body = 1.5 must be a whole number, the id of a body");
  world.bodies[1].programs = {*new_program("pid")};
  world.bodies[1].programs[0].parameters[0] = 1;
  EXPECT_EQ(check_programs(world).message(),
            "body \"lift\": program pid: joint = 1 must be at most 0, the number of joints");
  world.joints.resize(1);
  EXPECT_TRUE(check_programs(world).ok());
  world.bodies[1].programs = {*new_program("character")};
  EXPECT_EQ(check_programs(world).message(),
            "body \"lift\": program character: its body must be dynamic, not kinematic");
  world.bodies[1].properties.motion = Motion::kStatic;
  EXPECT_EQ(check_programs(world).message(),
            "body \"lift\": a body with a program must be dynamic or kinematic, not static");
}

TEST(Programs, BodiesAndJointsOfAModelBecomeThoseOfTheWorld) {
  ProgramRecord pad = *new_program("pad");
  move_ids(pad, 10, 100);
  EXPECT_EQ(pad.parameters[0], 0) << "nobody";
  pad.parameters[0] = 2;
  move_ids(pad, 10, 100);
  EXPECT_EQ(pad.parameters[0], 12);
  ProgramRecord pid = *new_program("pid");
  pid.parameters[0] = 3;
  move_ids(pid, 10, 100);
  EXPECT_EQ(pid.parameters[0], 103);
}

TEST(Programs, EarlierWorldsGetTheFirstValuesOfWhatIsNew) {
  ProgramRecord record = *new_program("mover");
  const ProgramRecord whole = record;
  record.parameters.resize(2);
  record.values.clear();
  complete(record);
  EXPECT_EQ(record.parameters, whole.parameters);
  EXPECT_EQ(record.values, whole.values);
}

}  // namespace
}  // namespace tessera
