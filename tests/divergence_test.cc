// Divergence on real clusters: no input ends a server, and what is stopped is named everywhere.
#include <fstream>
#include <nlohmann/json.hpp>

#include "lpss/model/limits.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A crate on the ground, and far away another one.
WorldDescription crates() {
  WorldDescription world = flat_world(8);
  add(world, solid("light", box(0.01, 0.01, 0.01), kMassMin, {{0, 0, 0}, {0.3, 0.2, 0.005}}));
  add(world, solid("crate", box(1, 1, 1), 10, {{0, 0, 0}, {30.3, 0.2, 0.5}}));
  return world;
}

TEST(DivergenceTest, TheLargestInputEndsNoServer) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(crates()).status(), IsOk());
  const std::unique_ptr<DivergenceStream> stream = client.watch_divergences(kPatience).value();
  EXPECT_EQ(stream->next(kPatience).value().tick, 0u);

  const std::string address = cluster.processes->address();
  const Outcome pushed = run_tessera({"impulse", "light", "--impulse", "1e12,0,0", "--connect", address});
  EXPECT_EQ(pushed.code, 0) << pushed.output;
  ASSERT_THAT(client.apply_impulse("crate", {0, 0, kImpulseMax}, {kLeverMax, 0, 0}).status(), IsOk());
  ASSERT_THAT(client.step(1, kPatience).status(), IsOk());
  ASSERT_THAT(client.apply_force("light", {kForceMax, 0, 0}, {0, kTorqueMax, 0}).status(), IsOk());
  ASSERT_THAT(client.step(20, kPatience).status(), IsOk());

  const DivergenceFrame first = stream->next(kPatience).value();
  EXPECT_EQ(first.tick, 1u);
  ASSERT_EQ(first.divergences.size(), 2u);
  EXPECT_EQ(first.divergences[0].body, client.find("light").value().id);
  EXPECT_EQ(first.divergences[1].body, client.find("crate").value().id);
  EXPECT_EQ(first.divergences[1].kind, DivergenceKind::kSpeed);
  EXPECT_EQ(stream->next(kPatience).value().divergences.size(), 1u);

  const ClusterStatus status = client.status().value();
  EXPECT_EQ(status.state, "paused");
  EXPECT_EQ(status.counts_since_load.diverged, 3u);
  ASSERT_EQ(status.divergences.size(), 3u);
  EXPECT_EQ(status.divergences[0].body_name, "light");
  EXPECT_EQ(status.divergences[2].tick, 2u);
  const Outcome shown = run_tessera({"status", "--connect", address});
  EXPECT_THAT(shown.output, HasSubstr("diverged: body 'light' at tick 1: speed above 1e+06 m/s, and 2 more"));
}

// One link on a hinge whose drive is far beyond what it bears.
constexpr char kWildArm[] =
    "<sdf version='1.9' xmlns:tessera='https://tessera.dev/sdf'><model name='arm'>"
    "<link name='link'><inertial><mass>0.001</mass><inertia><ixx>1e-6</ixx><iyy>1e-6</iyy><izz>1e-6</izz>"
    "</inertia></inertial><collision name='c'><pose>0.5 0 0 0 0 0</pose><geometry><box><size>1 0.02 "
    "0.02</size>"
    "</box></geometry></collision></link>"
    "<joint name='hinge' type='revolute'><parent>world</parent><child>link</child><axis><xyz>0 1 "
    "0</xyz></axis>"
    "<tessera:drive mode='effort' target='1e12'/></joint></model></sdf>";

class DivergentRunTest : public ::testing::Test {
 protected:
  DivergentRunTest() : folder_(cli::make_temporary_folder().value()) { std::ofstream(world()) << kWildArm; }
  ~DivergentRunTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::string world() const { return (folder_ / "arm.sdf").string(); }

  // With its report.
  std::pair<Outcome, nlohmann::json> run(std::vector<std::string> more) const {
    const std::filesystem::path file = folder_ / "report.json";
    more.insert(more.begin(), {"run", world(), "--seconds", "0.5", "--json", file.string()});
    Outcome outcome = run_tessera(more);
    std::ifstream in(file);
    return {std::move(outcome), nlohmann::json::parse(in, nullptr, false)};
  }

  std::filesystem::path folder_;
};

TEST_F(DivergentRunTest, FailsUnlessDivergenceIsAllowed) {
  const auto [outcome, report] = run({"--in-process"});
  EXPECT_EQ(outcome.code, 1) << outcome.output;
  EXPECT_THAT(outcome.output, AllOf(HasSubstr("diverged: body 'arm::link' at tick 1:"),
                                    HasSubstr("joint 'arm::hinge'"), HasSubstr("--allow-divergence")));
  EXPECT_GT(report["diverged"].get<int>(), 0);
  ASSERT_FALSE(report["divergences"].empty());
  EXPECT_EQ(report["divergences"][0]["body_name"], "arm::link");
  EXPECT_EQ(report["divergences"][0]["joint_name"], "arm::hinge");
  EXPECT_EQ(report["divergences"][0]["tick"], 1);

  const auto [allowed, same] = run({"--in-process", "--allow-divergence"});
  EXPECT_EQ(allowed.code, 0) << allowed.output;
  EXPECT_EQ(same["divergences"], report["divergences"]);
}

TEST_F(DivergentRunTest, IsNamedInARunFromASnapshot) {
  const std::string snapshot = (folder_ / "arm.snapshot").string();
  ASSERT_EQ(run({"--in-process", "--allow-divergence", "--snapshot", snapshot}).first.code, 0);
  const std::filesystem::path file = folder_ / "report.json";
  const Outcome outcome = run_tessera({"run", "--from", snapshot, "--in-process", "--allow-divergence",
                                       "--seconds", "0.5", "--json", file.string()});
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  std::ifstream in(file);
  const nlohmann::json report = nlohmann::json::parse(in, nullptr, false);
  ASSERT_FALSE(report["divergences"].empty());
  EXPECT_EQ(report["divergences"][0]["body_name"], "arm::link");
  EXPECT_EQ(report["divergences"][0]["joint_name"], "arm::hinge");
}

TEST_F(DivergentRunTest, IsTheSameOnServers) {
  const auto [alone, of_process] = run({"--in-process", "--allow-divergence"});
  const auto [outcome, of_cluster] = run({"--servers", "2"});
  EXPECT_EQ(outcome.code, 1) << outcome.output;
  EXPECT_EQ(of_cluster["divergences"], of_process["divergences"]);
  EXPECT_EQ(of_cluster["diverged"], of_process["diverged"]);
  EXPECT_EQ(of_cluster["world_hash"], of_process["world_hash"]);
}

TEST(FramesTest, OfFixedLinksAreFoundByName) {
  WorldDescription world = crates();
  world.frames.push_back({"crate::handle", world.bodies.size() - 1, {{0, 0, 0.5}, {0, 0, 0, 1}}});
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(world).status(), IsOk());
  const FoundFrame handle = client.find_frame("crate::handle").value();
  EXPECT_EQ(handle.body, client.find("crate").value().id);
  EXPECT_EQ(handle.body_name, "crate");
  EXPECT_EQ(handle.pose.position, Eigen::Vector3d(0, 0, 0.5));
  EXPECT_EQ(client.find_frames("cr").value().frames.size(), 1u);
  EXPECT_THAT(client.find_frame("crate::han").status(), IsStatus(absl::StatusCode::kNotFound, "crate::han"));
  EXPECT_THAT(client.apply_impulse("crate::handle", {1, 0, 0}).status(),
              IsStatus(absl::StatusCode::kInvalidArgument, "is a frame of the body 'crate'"));
  ASSERT_THAT(client.remove("crate").status(), IsOk());
  EXPECT_TRUE(client.find_frames("").value().frames.empty());
}

}  // namespace
}  // namespace tessera
