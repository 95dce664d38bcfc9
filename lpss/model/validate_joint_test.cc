// What a joint may be: springs, servos and what follows what.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "lpss/model/limits.h"
#include "lpss/model/validate.h"

namespace tessera {
namespace {

using testing::HasSubstr;

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

// Three hinges, 'j1' to 'j3', that hold three boxes.
WorldDescription hinged_world() {
  WorldDescription world;
  world.name = "hinged";
  world.shapes = {Shape{{{Box{}, Pose{}}}}};
  for (std::uint64_t n = 1; n <= 3; ++n) {
    BodyDescription box;
    box.name = "box" + std::to_string(n);
    world.bodies.push_back(box);
    JointDescription joint;
    joint.name = "j" + std::to_string(n);
    joint.properties.type = JointType::kRevolute;
    joint.properties.child = BodyId{n};
    world.joints.push_back(joint);
  }
  return world;
}

// Joints between the first box and the world.
void add_to_box1(WorldDescription& world, std::size_t joints) {
  for (std::size_t n = 1; n <= joints; ++n) {
    world.joints.push_back(world.joints[0]);
    world.joints.back().name = "more" + std::to_string(n);
  }
}

struct Fault {
  std::string name;
  std::function<void(WorldDescription&)> spoil;
  std::vector<std::string> said;

  friend void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }
};

std::function<void(WorldDescription&)> of_axis(std::function<void(JointAxis&)> spoil) {
  return [spoil](WorldDescription& world) { spoil(world.joints[0].properties.axes[0]); };
}

std::function<void(WorldDescription&)> of_drive(std::function<void(JointDrive&)> spoil) {
  return [spoil](WorldDescription& world) {
    world.joints[0].drives[0].mode = DriveMode::kServo;
    spoil(world.joints[0].drives[0]);
  };
}

void follow(WorldDescription& world, std::size_t follower, std::uint64_t leader) {
  world.joints[follower - 1].properties.axes[0].mimic.leader = JointId{leader};
}

std::vector<Fault> faults() {
  return {
      {"SpringNegative",
       of_axis([](auto& a) { a.spring_stiffness = -1; }),
       {"'j1': axis 1", "spring_stiffness = -1 N m/rad", "at least 0"}},
      {"SpringTooStiff",
       of_axis([](auto& a) { a.spring_stiffness = 1e13; }),
       {"spring_stiffness = 1e+13", "1e+12 N m/rad"}},
      {"SpringNan",
       of_axis([](auto& a) { a.spring_stiffness = kUndefined; }),
       {"spring_stiffness", "finite"}},
      {"ReferenceNan",
       of_axis([](auto& a) { a.spring_reference = kUndefined; }),
       {"spring_reference", "finite"}},
      {"ReferenceFar",
       of_axis([](auto& a) { a.spring_reference = -1e7; }),
       {"spring_reference = -1e+07 rad", "-1e+06 rad"}},
      {"StiffnessNegative",
       of_drive([](auto& d) { d.stiffness = -1; }),
       {"'j1': drive of axis 1", "stiffness = -1 N m/rad", "at least 0"}},
      {"DampingTooLarge",
       of_drive([](auto& d) { d.damping = 2e12; }),
       {"damping = 2e+12 N m s/rad", "1e+12 N m s/rad"}},
      {"TargetBeyondHalfATurn", of_drive([](auto& d) { d.target = 4; }), {"position = 4 rad", "3.14159 rad"}},
      {"VelocityNan", of_drive([](auto& d) { d.velocity = kUndefined; }), {"velocity", "finite"}},
      {"EffortTooLarge", of_drive([](auto& d) { d.effort = 1e13; }), {"effort = 1e+13 N m", "1e+12 N m"}},
      {"GainOfAnother",
       of_drive([](auto& d) {
         d = {DriveMode::kPosition, 0, 5};
       }),
       {"stiffness = 5", "only a servo"}},
      {"MultiplierNan",
       [](auto& world) {
         follow(world, 1, 2);
         world.joints[0].properties.axes[0].mimic.multiplier = kUndefined;
       },
       {"'j1': axis 1", "mimic multiplier", "finite"}},
      {"MultiplierTooLarge",
       [](auto& world) {
         follow(world, 1, 2);
         world.joints[0].properties.axes[0].mimic.multiplier = 2e6;
       },
       {"mimic multiplier = 2e+06", "1e+06"}},
      {"OffsetNan",
       [](auto& world) {
         follow(world, 1, 2);
         world.joints[0].properties.axes[0].mimic.offset = kUndefined;
       },
       {"mimic offset", "finite"}},
      {"LeaderMissing",
       [](auto& world) { follow(world, 1, 4); },
       {"'j1': axis 1", "mimic leader = 4", "1 to 3"}},
      {"LeaderWithoutTheAxis",
       [](auto& world) {
         follow(world, 1, 2);
         world.joints[0].properties.axes[0].mimic.axis = 1;
       },
       {"'j1': axis 1", "mimic axis = 2", "1 to 1"}},
      {"TooManyOfABody",
       [](auto& world) { add_to_box1(world, kJointsPerBodyMax); },
       {"joint 'more128'", "body 'box1'", "at most 128"}},
      {"FollowsItself", [](auto& world) { follow(world, 1, 1); }, {"joint 'j1'", "follow itself"}},
      {"FollowsInACircle",
       [](auto& world) {
         follow(world, 1, 2);
         follow(world, 2, 3);
         follow(world, 3, 1);
       },
       {"joint 'j", "follow itself"}},
  };
}

class RefusedJoint : public testing::TestWithParam<Fault> {};

TEST_P(RefusedJoint, WithFieldAndBound) {
  WorldDescription world = hinged_world();
  ASSERT_TRUE(validate(world).ok()) << validate(world);
  GetParam().spoil(world);
  const absl::Status status = validate(world);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  for (const std::string& part : GetParam().said) EXPECT_THAT(std::string(status.message()), HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(Joints, RefusedJoint, testing::ValuesIn(faults()),
                         [](const auto& fault) { return fault.param.name; });

TEST(AcceptedJoint, MayBeOneOfMany) {
  WorldDescription world = hinged_world();
  add_to_box1(world, kJointsPerBodyMax - 1);
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  BodyDescription rack;
  rack.name = "rack";
  rack.properties.motion = Motion::kStatic;
  world.bodies.push_back(rack);
  for (std::size_t n = 0; n < 2 * kJointsPerBodyMax; ++n) {
    BodyDescription book;
    book.name = "book" + std::to_string(n);
    world.bodies.push_back(book);
    JointDescription joint;
    joint.name = book.name;
    joint.properties.parent = BodyId{4};
    joint.properties.child = BodyId{world.bodies.size()};
    world.joints.push_back(joint);
  }
  EXPECT_TRUE(validate(world).ok()) << "what is static costs nothing: " << validate(world);
}

TEST(AcceptedJoint, MayBeFollowedByManyAndFollowAFollower) {
  WorldDescription world = hinged_world();
  follow(world, 1, 2);
  follow(world, 2, 3);
  EXPECT_TRUE(validate(world).ok()) << validate(world);
  follow(world, 1, 3);
  EXPECT_TRUE(validate(world).ok()) << validate(world);
}

}  // namespace
}  // namespace tessera
