// Worlds are loaded, refused, replaced and unloaded.
#include "coordinator/coordinator.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Kind = v1::ClusterMessage::KindCase;
using std::chrono::seconds;

v1::LoadRequest load_of(const WorldDescription& world, bool replace = false) {
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  request.set_replace(replace);
  return request;
}

TEST(Load, SendsStaticsToAllAndOthersToTheirHosts) {
  TestCluster cluster;
  cluster.join(kFirst);
  cluster.join(kSecond);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  EXPECT_EQ(cluster.status().state(), "loading");
  std::map<BodyId, int> seen;
  for (const NodeId node : {kFirst, kSecond}) {
    const auto messages = cluster.take(node, Kind::kLoadWorld);
    ASSERT_EQ(messages.size(), 1u);
    const v1::LoadWorld& world = messages[0].load_world();
    EXPECT_EQ(world.nodes_size(), 2);
    EXPECT_EQ(world.splitters_size(), 1);
    EXPECT_EQ(world.shapes_size(), 2);
    EXPECT_GT(world.radius_max(), 5);  // the lift
    const auto records = unpack_records(world.records());
    ASSERT_TRUE(records.ok());
    for (const BodyRecord& record : *records) ++seen[record.id];
    EXPECT_FALSE(load->status);
    cluster.loaded(node, world.world());
  }
  EXPECT_EQ(seen, (std::map<BodyId, int>{{BodyId{1}, 2}, {BodyId{2}, 1}, {BodyId{3}, 1}, {BodyId{4}, 1}}));
  ASSERT_TRUE(load->ok());
  EXPECT_EQ(load->answer.bodies(), 4u);
  EXPECT_EQ(load->answer.sectors(), 2u);
  EXPECT_EQ(load->answer.servers(), 2u);
  const v1::StatusReply status = cluster.status();
  EXPECT_EQ(status.state(), "paused");
  EXPECT_EQ(status.tick(), 0u);
  EXPECT_EQ(status.counts().at("sectors"), 2u);
}

TEST(Load, PlacesAWorldOnServersOfItsPrecision) {
  TestCluster cluster;
  cluster.join(kFirst, Precision::kFloat32);
  cluster.join(kSecond, Precision::kFloat64);
  WorldDescription world = small_world();
  world.settings.precision = Precision::kFloat64;
  cluster.ask<v1::LoadReply>(load_of(world));
  EXPECT_TRUE(cluster.take(kFirst, Kind::kLoadWorld).empty());
  EXPECT_EQ(cluster.take(kSecond, Kind::kLoadWorld).size(), 1u);
}

TEST(Load, WaitsForTheServersItWants) {
  CoordinatorOptions options;
  options.servers_wanted = 2;
  TestCluster cluster(options);
  cluster.join(kFirst);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  EXPECT_EQ(cluster.status().state(), "loading");
  EXPECT_TRUE(cluster.take(kFirst, Kind::kLoadWorld).empty());
  cluster.join(kSecond, Precision::kFloat64);  // not one of those
  EXPECT_TRUE(cluster.take(kFirst, Kind::kLoadWorld).empty());
  cluster.join(NodeId{300});
  cluster.finish_loads();
  ASSERT_TRUE(load->ok()) << load->message();
  EXPECT_EQ(load->answer.servers(), 2u);
}

v1::Hello hello_with(const std::vector<std::string>& labels) {
  v1::Hello hello = TestCluster::hello();
  hello.mutable_labels()->Add(labels.begin(), labels.end());
  return hello;
}

TEST(Load, WaitsForServersWithItsLabels) {
  CoordinatorOptions options;
  options.required_labels = {"disk=ssd", "zone=eu"};
  options.join_timeout = seconds(5);
  TestCluster cluster(options);
  cluster.join(kFirst, hello_with({"zone=us", "disk=ssd"}));
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.advance(seconds(5));
  EXPECT_THAT(load->message(),
              HasSubstr("needs 1 servers of precision f32 with the labels disk=ssd, zone=eu, "
                        "but there are 0"));

  const auto again = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.join(kSecond, hello_with({"zone=eu", "rack=a7", "disk=ssd"}));
  EXPECT_TRUE(cluster.take(kFirst, Kind::kLoadWorld).empty());
  cluster.finish_loads();
  ASSERT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.servers(), 1u);
  EXPECT_THAT(cluster.status().servers(1).labels(), ElementsAre("zone=eu", "rack=a7", "disk=ssd"));
}

TEST(Load, ServersOfARackAreNextToEachOtherOnTheCurve) {
  CoordinatorOptions options;
  options.servers_wanted = 5;
  TestCluster cluster(options);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.join(NodeId{1}, hello_with({"zone=b", "rack=1"}));
  cluster.join(NodeId{2}, hello_with({"zone=a", "rack=2"}));
  cluster.join(NodeId{3}, hello_with({"zone=b", "rack=1"}));
  cluster.join(NodeId{4}, hello_with({"zone=a", "rack=1"}));
  cluster.join(NodeId{5}, hello_with({"zone=a", "rack=2"}));
  const auto sent = cluster.take(NodeId{1}, Kind::kLoadWorld);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_THAT(sent[0].load_world().nodes(), ElementsAre(4, 2, 5, 1, 3));
}

TEST(Load, SaysWhichServersNeverCame) {
  CoordinatorOptions options;
  options.servers_wanted = 3;
  options.join_timeout = seconds(5);
  TestCluster cluster(options);
  cluster.join(kFirst);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.advance(seconds(4));
  EXPECT_FALSE(load->status);
  EXPECT_EQ(*cluster.coordinator->next_deadline(), cluster.now + seconds(1));
  cluster.advance(seconds(1));
  EXPECT_EQ(load->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(load->message(), HasSubstr("needs 3 servers of precision f32, but there are 1"));
  EXPECT_EQ(cluster.status().state(), "empty");
}

TEST(Load, RefusesABadWorldAndKeepsTheOneThatIsThere) {
  const auto cluster = loaded_cluster();
  WorldDescription bad = small_world();
  bad.bodies[1].properties.mass = -1;
  auto load = cluster->ask<v1::LoadReply>(load_of(bad, /*replace=*/true));
  EXPECT_EQ(load->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(load->message(), HasSubstr("body 'ball': mass"));

  v1::LoadRequest unset;
  unset.set_replace(true);
  EXPECT_EQ(cluster->ask<v1::LoadReply>(unset)->code(), absl::StatusCode::kInvalidArgument);

  EXPECT_EQ(cluster->ask<v1::LoadReply>(load_of(small_world()))->code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(cluster->status().state(), "paused");
  EXPECT_TRUE(cluster->inbox[kFirst].empty());
}

TEST(Load, ReplacesWhenAskedTo) {
  const auto cluster = loaded_cluster();
  WorldDescription other = small_world();
  other.name = "other";
  v1::ResumeRequest resume;
  cluster->ask<v1::ResumeReply>(resume);
  const auto load = cluster->ask<v1::LoadReply>(load_of(other, /*replace=*/true));
  cluster->take_grants(kFirst);
  cluster->take_grants(kSecond);
  EXPECT_EQ(cluster->ask<v1::LoadReply>(load_of(other, /*replace=*/true))->code(),
            absl::StatusCode::kFailedPrecondition);
  cluster->report(kFirst, 1, 5);  // of the world that is gone
  cluster->finish_loads();
  ASSERT_TRUE(load->ok());
  EXPECT_EQ(cluster->status().world(), "other");
  EXPECT_EQ(cluster->status().tick(), 0u);
  EXPECT_EQ(cluster->status().state(), "paused");
}

TEST(Load, AServerThatCannotIsNamed) {
  TestCluster cluster;
  cluster.join(kFirst);
  cluster.join(kSecond);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.loaded(kFirst, 1, "no engine here");
  EXPECT_EQ(load->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(load->message(), HasSubstr("no engine here"));
  EXPECT_THAT(load->message(), HasSubstr("server 64"));
  EXPECT_EQ(cluster.status().state(), "empty");
  EXPECT_EQ(cluster.take(kSecond, Kind::kUnloadWorld).size(), 1u);
}

// What is there stays until the new world has begun: it goes on where it was.
TEST(Load, BringsTheWorldBackThatCouldNotBeReplaced) {
  CoordinatorOptions options;
  options.checkpoint_every = seconds(1);
  const auto cluster = loaded_cluster(options);
  ASSERT_TRUE(cluster->apply(spawn("new"))->ok());
  WorldDescription other = small_world();
  other.name = "other";
  const auto load = cluster->ask<v1::LoadReply>(load_of(other, /*replace=*/true));
  cluster->take(kFirst, Kind::kLoadWorld);
  cluster->take(kSecond, Kind::kLoadWorld);
  EXPECT_EQ(cluster->apply(push("ball"))->code(), absl::StatusCode::kFailedPrecondition)
      << "it is being replaced";
  cluster->loaded(kFirst, 2, "no memory");
  EXPECT_EQ(load->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(load->message(), HasSubstr("no memory"));
  EXPECT_EQ(cluster->status().world(), "small");
  EXPECT_EQ(cluster->status().state(), "recovering");
  cluster->finish_loads();
  EXPECT_EQ(cluster->status().state(), "paused");
  EXPECT_EQ(cluster->status().bodies(), 5u) << "with what was accepted before";
  EXPECT_TRUE(cluster->apply(push("new"))->ok());
  cluster->step(1);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(unpack_commands(grants[0].commands())->size(), 2u);
}

TEST(Load, IsTriedAgainWhereAServerIsLost) {
  CoordinatorOptions options;
  options.checkpoint_every = seconds(1);
  options.join_timeout = seconds(5);
  const auto cluster = loaded_cluster(options);
  WorldDescription other = small_world();
  other.name = "other";
  const auto load = cluster->ask<v1::LoadReply>(load_of(other, /*replace=*/true));
  cluster->coordinator->ended(kSecond, cluster->now);
  cluster->collect();
  EXPECT_FALSE(load->status);
  cluster->finish_loads();
  ASSERT_TRUE(load->ok()) << load->message();
  EXPECT_EQ(load->answer.servers(), 1u);
  EXPECT_EQ(cluster->status().world(), "other");

  // One that ends whoever loads it is given up.
  other.name = "poison";
  const auto poison = cluster->ask<v1::LoadReply>(load_of(other, /*replace=*/true));
  for (const NodeId node : {kFirst, NodeId{300}, NodeId{301}}) {
    EXPECT_FALSE(poison->status);
    cluster->coordinator->ended(node, cluster->now);
    cluster->join(NodeId{node == kFirst ? 300 : node.value + 1});
  }
  EXPECT_EQ(poison->code(), absl::StatusCode::kUnavailable);
  cluster->advance(kGatherServers);
  cluster->finish_loads();
  EXPECT_EQ(cluster->status().world(), "other");
  EXPECT_EQ(cluster->status().state(), "paused");
}

TEST(Load, AServerMayTakeLongToLoad) {
  CoordinatorOptions options;
  options.server_timeout = seconds(1);
  TestCluster cluster(options);
  cluster.join(kFirst);
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  cluster.advance(seconds(100));
  cluster.finish_loads();
  EXPECT_TRUE(load->ok());
  cluster.advance(seconds(1));
  EXPECT_EQ(cluster.status().state(), "failed");
}

TEST(Unload, ForgetsTheWorld) {
  const auto cluster = loaded_cluster();
  EXPECT_TRUE(cluster->ask<v1::UnloadReply>(v1::UnloadRequest())->ok());
  EXPECT_EQ(cluster->take(kFirst, Kind::kUnloadWorld).size(), 1u);
  EXPECT_EQ(cluster->take(kSecond, Kind::kUnloadWorld).size(), 1u);
  EXPECT_EQ(cluster->status().state(), "empty");
  EXPECT_EQ(cluster->ask<v1::UnloadReply>(v1::UnloadRequest())->code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(cluster->ask<v1::PauseReply>(v1::PauseRequest())->code(), absl::StatusCode::kFailedPrecondition);
}

TEST(Unload, EndsALoadThatWaits) {
  TestCluster cluster;
  const auto load = cluster.ask<v1::LoadReply>(load_of(small_world()));
  EXPECT_TRUE(cluster.ask<v1::UnloadReply>(v1::UnloadRequest())->ok());
  EXPECT_EQ(load->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(cluster.status().state(), "empty");
}

}  // namespace
}  // namespace tessera
