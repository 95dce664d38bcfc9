#include "coordinator/ownership.h"

#include "coordinator/command_list.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

class Ownership : public ::testing::Test {
 protected:
  absl::Status give(const std::vector<v1::Command>& list, const std::string& owner) {
    const absl::Status status = tessera::give(request_of(list).commands(), registry_, 1, owner).status();
    if (status.ok()) {
      registry_.keep();
    } else {
      registry_.roll_back();
    }
    return status;
  }
  void expect_denied(const std::vector<v1::Command>& list, const std::string& owner,
                     const std::string& reason) {
    const absl::Status status = give(list, owner);
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << list[0].DebugString();
    EXPECT_THAT(std::string(status.message()), HasSubstr(reason));
  }
  v1::FoundBodies::Found found(const std::string& name) const {
    v1::FindBodies query;
    query.set_name_prefix(name);
    return registry_.find(query).bodies(0);
  }

  WorldRegistry registry_ = registry_of(small_world());  // "floor", "ball", "lift", "egg"
};

v1::Command properties_of(const std::string& body) {
  v1::Command command;
  command.mutable_set_properties()->mutable_body()->set_name(body);
  return command;
}

TEST_F(Ownership, WhatIsSpawnedIsTheOwners) {
  ASSERT_TRUE(give({spawn("mine"), push("mine"), spawn("pet"), hinge("leash", "mine", "pet"),
                    drive("leash", 1, v1::JointDrive::VELOCITY, 1)},
                   "alice")
                  .ok());
  EXPECT_EQ(found("mine").owner(), "alice");
  EXPECT_TRUE(give({push("mine"), hinge("nail", "", "mine")}, "alice").ok()) << "the world is everybody's";
  EXPECT_TRUE(give({push("mine"), push("ball")}, "").ok()) << "nobody is limited without an owner";
}

TEST_F(Ownership, NothingElseIsCommanded) {
  ASSERT_TRUE(give({spawn("mine"), hinge("nail", "", "mine"), hinge("pin", "", "egg")}, "alice").code() ==
              absl::StatusCode::kPermissionDenied)
      << "the egg is nobody's";
  ASSERT_TRUE(give({spawn("mine"), hinge("nail", "", "mine")}, "alice").ok());
  ASSERT_TRUE(give({hinge("pin", "", "egg")}, "").ok());
  v1::Command blast;
  blast.mutable_apply_radial_impulse()->mutable_centre();
  v1::Command placed;
  placed.mutable_set_state()->add_bodies()->mutable_body()->set_name("ball");
  *placed.mutable_set_state()->mutable_bodies(0)->mutable_pose() = to_proto(WorldPose{});
  v1::Command belt;
  belt.mutable_set_surface_motion()->mutable_body()->set_name("floor");
  v1::Command data = properties_of("ball");
  data.mutable_set_properties()->set_user_data("x");
  v1::Command heavier = properties_of("ball");
  heavier.mutable_set_properties()->set_mass(7);
  const std::string balls = "body 'ball': it is not owned by 'alice'";
  for (const v1::Command& command :
       {push("ball"), velocity(2, 1), teleport("ball", {}), removal("ball"), placed, data, heavier})
    expect_denied({command}, "alice", balls);
  expect_denied({push("mine"), push("ball")}, "alice", "commands[1] (apply_impulse): " + balls);
  expect_denied({hinge("rope", "mine", "ball")}, "alice", balls);
  expect_denied({hinge("rope", "ball", "mine")}, "alice", balls);
  expect_denied({drive("pin", 1, v1::JointDrive::VELOCITY, 1)}, "alice", "body 'egg'");
  expect_denied({removal_of_joint("pin")}, "alice", "body 'egg'");
  expect_denied({belt}, "alice", "body 'floor'");
  expect_denied({removal_of_all("b")}, "alice", balls);
  expect_denied({blast}, "alice", "all owners");
  expect_denied({push("mine")}, "bob", "not owned by 'bob'");
  EXPECT_EQ(registry_.find(BodyId{2})->tags.user_data, "");
}

v1::Command spawn_with(const std::string& name, const std::string& program) {
  v1::Command command = spawn(name);
  command.mutable_spawn()->mutable_model()->mutable_bodies(0)->add_programs()->set_kind(program);
  return command;
}

v1::Command tell(const std::string& body, const std::string& number, std::uint64_t value) {
  v1::Command command;
  command.mutable_tell_program()->mutable_body()->set_name(body);
  v1::NamedNumber& told = *command.mutable_tell_program()->add_numbers();
  told.set_name(number);
  told.set_value(static_cast<double>(value));
  return command;
}

TEST_F(Ownership, ProgramsActOnNothingElse) {
  ASSERT_TRUE(give({hinge("pin", "", "egg")}, "").ok());
  ASSERT_TRUE(
      give({spawn_with("plate", "pad"), spawn_with("servo", "pid"), hinge("nail", "", "servo")}, "alice")
          .ok());
  const std::uint64_t plate = found("plate").id();
  EXPECT_TRUE(
      give({tell("plate", "body", plate), tell("plate", "body", 0), tell("servo", "joint", 2)}, "alice")
          .ok());
  expect_denied({tell("plate", "body", 2)}, "alice", "body: body 'ball': it is not owned by 'alice'");
  expect_denied({tell("servo", "joint", 1)}, "alice", "joint: body 'egg'");
  EXPECT_TRUE(give({tell("plate", "body", 2), tell("servo", "joint", 1)}, "").ok());
  for (const char* kind : {"field", "portal"})
    expect_denied({spawn_with("zone", kind)}, "alice", "acts on bodies of all owners");
  v1::Command module = spawn("own");
  module.mutable_spawn()->mutable_model()->add_modules("any");
  expect_denied({module}, "alice", "only a request without an owner may bring modules");
}

TEST_F(Ownership, IsGivenByWhoHasNoLimits) {
  v1::Command gift = properties_of("ball");
  gift.mutable_set_properties()->set_owner("alice");
  expect_denied({gift}, "bob", "not owned by 'bob'");
  ASSERT_TRUE(give({gift}, "").ok());
  EXPECT_TRUE(give({push("ball")}, "alice").ok());
  gift.mutable_set_properties()->set_owner("bob");
  expect_denied({gift}, "alice", "only a request without an owner");
  gift.mutable_set_properties()->set_owner("");
  ASSERT_TRUE(give({gift}, "").ok());
  expect_denied({push("ball")}, "alice", "not owned");
}

TEST_F(Ownership, TagsHaveBounds) {
  v1::Command data = properties_of("ball");
  data.mutable_set_properties()->set_user_data(std::string(kUserDataBytesMax, '\xff'));
  EXPECT_TRUE(give({data}, "").ok());
  EXPECT_EQ(found("ball").user_data().size(), kUserDataBytesMax);
  data.mutable_set_properties()->set_user_data(std::string(kUserDataBytesMax + 1, '\0'));
  EXPECT_THAT(std::string(give({data}, "").message()),
              HasSubstr("user data: 1025 bytes must be at most 1024"));
  v1::Command gift = properties_of("ball");
  gift.mutable_set_properties()->set_owner(std::string(kNameBytesMax + 1, 'x'));
  EXPECT_THAT(std::string(give({gift}, "").message()), HasSubstr("owner: 1025 bytes must be at most 1024"));
  EXPECT_THAT(std::string(give({push("ball")}, std::string("\xff")).message()), HasSubstr("UTF-8"));
}

// Neither wakes anything, nor is any server told.
TEST_F(Ownership, TagsAreNoMatterOfServers) {
  v1::Command data = properties_of("ball");
  data.mutable_set_properties()->set_user_data("inventory");
  data.mutable_set_properties()->set_owner("alice");
  EXPECT_TRUE(tessera::give(request_of({data}).commands(), registry_, 1)->commands.empty());
}

}  // namespace
}  // namespace tessera
