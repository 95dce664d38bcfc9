// Joints over several servers: motors reach their speed, machines hold together across borders, and commands
// add and remove joints.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "lpss/programs/registry.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

constexpr double kGapMax = 0.02;  // m

class MachinesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    cluster_ = start_cluster(2);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(client().load(read_world("machines.sdf")).status(), IsOk());
  }

  Client& client() { return *cluster_.client; }

  std::unique_ptr<JointStream> watch(const std::string& prefix) {
    auto stream = client().watch_joints(client().find_joints(prefix).value().joints, 1, kPatience);
    EXPECT_THAT(stream.status(), IsOk());
    return stream.ok() ? *std::move(stream) : nullptr;
  }

  // The joints after another `ticks` ticks.
  JointFrame after(std::uint64_t ticks, JointStream& stream) {
    const absl::StatusOr<Tick> tick = client().step(ticks, kPatience);
    EXPECT_THAT(tick.status(), IsOk());
    for (;;) {
      absl::StatusOr<JointFrame> frame = stream.next(kPatience);
      EXPECT_THAT(frame.status(), IsOk());
      if (!frame.ok() || frame->tick >= *tick) return frame.ok() ? *std::move(frame) : JointFrame{};
      for (const JointSample& sample : frame->joints) gap_max_ = std::max(gap_max_, sample.state.gap);
    }
  }

  Cluster cluster_;
  double gap_max_ = 0;  // of all frames that were read
};

TEST_F(MachinesTest, MotorsReachTheirTargets) {
  const std::unique_ptr<JointStream> stream = watch("cart::left_motor");
  ASSERT_TRUE(stream);
  EXPECT_NEAR(after(120, *stream).joints.at(0).state.velocity[0], 4, 0.05);
  EXPECT_EQ(client().set_drive("cart::left_motor", {DriveMode::kVelocity, -2}).value(), 121u);
  ASSERT_THAT(client().set_drive("cart::right_motor", {DriveMode::kVelocity, -2}).status(), IsOk());
  EXPECT_NEAR(after(120, *stream).joints.at(0).state.velocity[0], -2, 0.05);
}

TEST_F(MachinesTest, TheDoorGoesToItsPosition) {
  ASSERT_THAT(client().set_drive("door::hinge", {DriveMode::kPosition, -0.8}).status(), IsOk());
  const std::unique_ptr<JointStream> stream = watch("door::hinge");
  ASSERT_TRUE(stream);
  EXPECT_NEAR(after(180, *stream).joints.at(0).state.position[0], -0.8, 0.02);
}

// The cart drives over the border, and chain and pendulum swing over it.
TEST_F(MachinesTest, HoldTogetherAcrossBorders) {
  const BodyId chassis = client().find("cart::chassis").value().id;
  const std::unique_ptr<JointStream> stream = watch("");
  ASSERT_TRUE(stream);
  EXPECT_EQ(after(300, *stream).joints.size(), 26u);
  EXPECT_LT(gap_max_, kGapMax);
  const std::unique_ptr<BodyStream> bodies = client().watch_bodies({.ids = {chassis}}, kPatience).value();
  EXPECT_EQ(bodies->next(kPatience).value().bodies.at(0).pose.position.sector, SectorIndex{1});
}

TEST_F(MachinesTest, JointsComeAndGo) {
  ASSERT_THAT(client().spawn(solid("lamp", box(0.2, 0.2, 0.2), 1, {{0, 0, 0}, {7.95, 5, 4}})).status(),
              IsOk());
  ASSERT_THAT(client().spawn(solid("shade", box(0.2, 0.2, 0.2), 1, {{0, 0, 0}, {7.95, 5, 3.5}})).status(),
              IsOk());
  NewJoint hook;
  hook.joint.name = "hook";
  hook.joint.properties.type = JointType::kBall;
  hook.joint.properties.in_parent.position = {7.95, 5, 4.5};
  hook.joint.properties.in_child.position = {0, 0, 0.5};
  hook.child = "lamp";
  EXPECT_EQ(client().add_joint(hook).value().id, JointId{27});
  NewJoint rod = hook;
  rod.joint.name.clear();
  rod.joint.properties.type = JointType::kFixed;
  rod.joint.properties.in_parent.position = {0, 0, -0.5};
  rod.joint.properties.in_child.position = {0, 0, 0};
  rod.parent = "lamp";
  rod.child = "shade";
  EXPECT_EQ(client().add_joint(rod).value().id, JointId{28});

  std::unique_ptr<JointStream> stream = watch("hook");
  EXPECT_LT(after(60, *stream).joints.at(0).state.gap, kGapMax);
  const FoundJoint found = client().find_joint("joint_28").value();
  EXPECT_EQ(found.parent, "lamp");
  EXPECT_EQ(found.child, "shade");

  ASSERT_THAT(client().remove_joint("hook").status(), IsOk());
  ASSERT_THAT(client().step(30, kPatience).status(), IsOk());
  EXPECT_GT(after(1, *stream).joints.at(0).state.gap, 0.5);  // it falls
  ASSERT_THAT(client().remove("shade").status(), IsOk());
  EXPECT_EQ(client().find_joint("joint_28").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(client().add_joint(rod).status(), IsStatus(absl::StatusCode::kNotFound, "'shade'"));
  EXPECT_THAT(client().set_drive("door::hinge", {DriveMode::kPosition, 9}).status(),
              IsStatus(absl::StatusCode::kInvalidArgument, "position = 9 rad"));
}

// A static parent is streamed as well, by the one server that hosts its sector.
TEST_F(MachinesTest, ParentsThatNeverMove) {
  NewJoint hinge;
  hinge.joint.name = "leash";
  hinge.joint.properties.type = JointType::kBall;
  hinge.joint.properties.in_parent.position = {0.6, 0, 0};  // the post is 0.6 m from the panel's middle
  hinge.parent = "door_post::post";
  hinge.child = "door::panel";
  ASSERT_THAT(client().add_joint(hinge).status(), IsOk());
  const std::unique_ptr<JointStream> stream = watch("leash");
  ASSERT_TRUE(stream);
  EXPECT_LT(after(10, *stream).joints.at(0).state.gap, 0.05);
}

TEST_F(MachinesTest, TheCommandLineShowsAndDrivesThem) {
  const std::string address = cluster_.processes->address();
  const Outcome table = run_tessera({"joints", "cart::", "--connect", address});
  EXPECT_EQ(table.code, 0) << table.output;
  EXPECT_THAT(table.output, HasSubstr("velocity 4"));
  EXPECT_THAT(table.output, HasSubstr("cart::castor_mount"));
  const Outcome drive = run_tessera({"drive", "cart::left_motor", "velocity", "-1.5", "--connect", address});
  EXPECT_EQ(drive.code, 0) << drive.output;
  EXPECT_EQ(client().find_joint("cart::left_motor").value().joint.drives[0],
            (JointDrive{DriveMode::kVelocity, -1.5}));
  const std::filesystem::path file = cli::make_temporary_folder().value() / "joints.json";
  ASSERT_EQ(run_tessera({"joints", "pendulum", "--connect", address, "--json", file.string()}).code, 0);
  std::ifstream in(file);
  const nlohmann::json data = nlohmann::json::parse(in, nullptr, false);
  std::filesystem::remove_all(file.parent_path());
  ASSERT_EQ(data["joints"].size(), 2u);
  EXPECT_EQ(data["joints"][0]["name"], "pendulum::pin_1");
  EXPECT_EQ(data["joints"][0]["position"].size(), 1u);
  EXPECT_EQ(run_tessera({"drive", "cart::left_motor", "sideways", "--connect", address}).code, 2);
  const Outcome nobody = run_tessera({"drive", "nobody", "free", "--connect", address});
  EXPECT_EQ(nobody.code, 1);
  EXPECT_THAT(nobody.output, HasSubstr("no joint with the name 'nobody'"));
}

// A weight of 20 N on a thread that bears 5.
TEST(TornJoints, AreListedNoMore) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  WorldDescription world;
  world.name = "thread";
  world.shapes = {box(0.2, 0.2, 0.2)};
  BodyDescription weight;
  weight.name = "weight";
  weight.properties.mass = 2;
  weight.properties.inertia = {0.013, 0.013, 0.013};
  weight.programs.push_back(*new_program("breaker"));
  ASSERT_THAT(set_number(weight.programs[0], "force", 5), IsOk());
  world.bodies = {weight};
  JointDescription thread;
  thread.name = "thread";
  thread.properties.type = JointType::kBall;
  thread.properties.child = BodyId{1};
  thread.properties.in_child.position = {0, 0, 0.5};
  thread.properties.in_parent.position = {0, 0, 0.5};
  world.joints = {thread};
  ASSERT_THAT(client.load(world).status(), IsOk());
  ASSERT_THAT(client.find_joint("thread").status(), IsOk());
  ASSERT_THAT(client.step(30, kPatience).status(), IsOk());
  EXPECT_EQ(client.find_joint("thread").status().code(), absl::StatusCode::kNotFound);

  const std::filesystem::path file = cli::make_temporary_folder().value() / "torn.tsnap";
  ASSERT_THAT(client.snapshot(file).status(), IsOk());
  ASSERT_THAT(client.restore(file, /*replace=*/true).status(), IsOk());
  std::filesystem::remove_all(file.parent_path());
  EXPECT_EQ(client.find_joint("thread").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(client.teleport("weight", {.position = {{}, {0, 0, 1}}}).status(), IsOk());
}

}  // namespace
}  // namespace tessera
