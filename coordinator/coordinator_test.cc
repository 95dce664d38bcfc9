// Servers come, go and are lost; time goes on, stands still, and ends.
#include "coordinator/coordinator.h"

#include <absl/strings/str_cat.h>

#include <limits>

#include "coordinator/test_cluster.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using Kind = v1::ClusterMessage::KindCase;
using std::chrono::milliseconds;
using std::chrono::seconds;

std::string refusal_of(const v1::Hello& hello) {
  TestCluster cluster;
  v1::ClusterMessage message;
  *message.mutable_hello() = hello;
  cluster.receive(kFirst, message);
  EXPECT_TRUE(cluster.take(kFirst, Kind::kWelcome).empty());
  EXPECT_EQ(cluster.status().servers_size(), 0);
  const auto refusals = cluster.take(kFirst, Kind::kRefusal);
  return refusals.size() == 1 ? refusals[0].refusal().reason() : "";
}

TEST(Membership, WelcomesAServerOnceAndAgain) {
  TestCluster cluster;
  cluster.join(kFirst);
  cluster.join(kFirst);
  const auto welcomes = cluster.take(kFirst, Kind::kWelcome);
  ASSERT_EQ(welcomes.size(), 2u);
  EXPECT_GT(welcomes[0].welcome().heartbeat_ms(), 0u);
  const v1::StatusReply status = cluster.status();
  EXPECT_EQ(status.state(), "empty");
  ASSERT_EQ(status.servers_size(), 1);
  EXPECT_EQ(status.servers(0).node(), kFirst.value);
  EXPECT_EQ(status.servers(0).stream_address(), "127.0.0.1:1");
  EXPECT_EQ(status.servers(0).threads(), 2u);
  EXPECT_EQ(status.servers(0).capacity(), 2);
}

TEST(Membership, RefusesOtherProtocolsAndLayoutsWithBothValues) {
  v1::Hello hello = TestCluster::hello();
  hello.set_protocol(kClusterProtocol + 41);
  const std::string protocol = refusal_of(hello);
  EXPECT_THAT(protocol, HasSubstr(std::to_string(kClusterProtocol + 41)));
  EXPECT_THAT(protocol, HasSubstr("the coordinator " + std::to_string(kClusterProtocol)));

  hello = TestCluster::hello();
  hello.set_layout(0xabc);
  EXPECT_THAT(refusal_of(hello), HasSubstr("layout abc"));

  hello = TestCluster::hello();
  hello.set_precision(static_cast<v1::Precision>(7));
  EXPECT_THAT(refusal_of(hello), HasSubstr("precision = 7"));
}

// As in an upgrade, one process after the other, where what is exchanged has changed.
TEST(Membership, AWorldThatRunsGoesOnWithoutServersOfAnotherBuild) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  v1::Hello hello = TestCluster::hello();
  hello.set_layout(wire_layout() ^ 1);
  constexpr NodeId kOfAnotherBuild{300};
  cluster->join(kOfAnotherBuild, hello);
  const auto refusals = cluster->take(kOfAnotherBuild, v1::ClusterMessage::kRefusal);
  ASSERT_EQ(refusals.size(), 1u);
  const v1::Refusal& refusal = refusals[0].refusal();
  EXPECT_FALSE(refusal.may_rejoin());
  for (const std::uint64_t layout : {wire_layout(), wire_layout() ^ 1})
    EXPECT_THAT(refusal.reason(), HasSubstr(absl::StrCat(absl::Hex(layout))));
  EXPECT_EQ(cluster->status().servers_size(), 2);
  for (const NodeId node : {kFirst, kSecond}) cluster->work(node);
  EXPECT_GT(cluster->status().tick(), 0u);
  EXPECT_EQ(cluster->status().state(), "running");
}

TEST(Membership, RefusesCapacitiesAndLabelsBeyondTheirBounds) {
  for (const double capacity : {0.0, 1e-9, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e7}) {
    v1::Hello hello = TestCluster::hello();
    hello.set_capacity(capacity);
    EXPECT_THAT(refusal_of(hello), HasSubstr("must be 0.001 to 1e+06"));
  }
  v1::Hello hello = TestCluster::hello();
  hello.add_labels("zone");
  EXPECT_THAT(refusal_of(hello), HasSubstr("\"zone\" must be key=value"));
}

TEST(Membership, RefusesServersThatComputeOtherBits) {
  v1::Hello hello = TestCluster::hello();
  hello.set_arithmetic(arithmetic_fingerprint() ^ 1);
  const std::string refusal = refusal_of(hello);
  EXPECT_THAT(refusal, HasSubstr("other bits"));
  EXPECT_THAT(refusal, HasSubstr(absl::StrCat(absl::Hex(hello.arithmetic()))));
  EXPECT_THAT(refusal, HasSubstr(absl::StrCat(absl::Hex(arithmetic_fingerprint()))));
  hello.mutable_arithmetic_parts()->Add(arithmetic_parts().begin(), arithmetic_parts().end());
  hello.set_arithmetic_parts(4, 1);
  EXPECT_THAT(refusal_of(hello), HasSubstr("they differ in SLEEF's functions"));
}

TEST(Membership, WorldsGetLargerNumbersThanServersHaveHadOfTheirKind) {
  const auto first_world_after = [](std::uint64_t newest) {
    TestCluster cluster(CoordinatorOptions{.worlds_before = 10, .worlds_max = 99});
    v1::ClusterMessage message;
    *message.mutable_hello() = TestCluster::hello();
    message.mutable_hello()->set_newest_world(newest);
    cluster.receive(kFirst, message);
    v1::LoadRequest request;
    *request.mutable_world() = to_proto(small_world());
    cluster.ask<v1::LoadReply>(request);
    const auto loads = cluster.take(kFirst, Kind::kLoadWorld);
    return loads.empty() ? 0 : loads[0].load_world().world();
  };
  EXPECT_EQ(first_world_after(0), 11u);
  EXPECT_EQ(first_world_after(50), 51u);
  EXPECT_EQ(first_world_after(100), 11u) << "of a coordinator that leads later";
}

TEST(Membership, HasALimit) {
  TestCluster cluster;
  for (std::uint64_t n = 0; n < kServersMax; ++n) cluster.join(NodeId{1000 + n});
  cluster.join(NodeId{9999});
  EXPECT_EQ(cluster.take(NodeId{9999}, Kind::kRefusal).size(), 1u);
  EXPECT_EQ(cluster.status().servers_size(), static_cast<int>(kServersMax));
}

TEST(Membership, AStrangerIsToldOnceToEnd) {
  TestCluster cluster;
  cluster.report(kFirst, 3, 5);
  cluster.report(kFirst, 3, 6);
  EXPECT_EQ(cluster.take(kFirst, Kind::kRefusal).size(), 1u);
  cluster.join(kFirst);
  EXPECT_EQ(cluster.take(kFirst, Kind::kWelcome).size(), 1u);
}

TEST(Membership, HeartbeatsKeepAServerSilenceLosesIt) {
  CoordinatorOptions options;
  options.server_timeout = seconds(10);
  const auto cluster = loaded_cluster(options);
  for (int n = 0; n < 10; ++n) {
    cluster->advance(seconds(5));
    cluster->report(kFirst, 0, 0);
    cluster->report(kSecond, 1, 0);
  }
  EXPECT_EQ(cluster->status().state(), "paused");
  cluster->advance(seconds(5));
  cluster->report(kFirst, 1, 0);
  ASSERT_TRUE(cluster->coordinator->next_deadline());
  EXPECT_EQ(*cluster->coordinator->next_deadline(), cluster->now + seconds(5));
  cluster->advance(seconds(5));
  const v1::StatusReply status = cluster->status();
  EXPECT_EQ(status.state(), "failed");
  EXPECT_THAT(status.failure(), HasSubstr("server c8"));
  EXPECT_THAT(status.failure(), HasSubstr("silent for 10 s"));
  EXPECT_EQ(status.servers_size(), 1);
  EXPECT_EQ(cluster->take(kFirst, Kind::kUnloadWorld).size(), 1u);
  EXPECT_EQ(cluster->take(kSecond, Kind::kRefusal).size(), 1u);
}

TEST(Suspect, ComesBackAndTheWorldGoesOn) {
  const auto cluster = loaded_cluster();
  const auto step = cluster->step(10);
  EXPECT_TRUE(cluster->coordinator->suspect(kSecond, cluster->now));
  EXPECT_FALSE(cluster->status().servers(0).suspect());
  EXPECT_TRUE(cluster->status().servers(1).suspect());
  cluster->advance(seconds(9));
  cluster->work_all();
  EXPECT_FALSE(cluster->status().servers(1).suspect());
  EXPECT_TRUE(step->ok()) << step->message();
  EXPECT_EQ(cluster->status().state(), "paused");
}

TEST(Suspect, IsLostWhenItsTimeIsUp) {
  CoordinatorOptions options;
  options.server_timeout = seconds(4);
  const auto cluster = loaded_cluster(options);
  cluster->coordinator->suspect(kSecond, cluster->now);
  cluster->advance(milliseconds(3999));
  cluster->report(kFirst, 1, 0);
  EXPECT_EQ(cluster->status().state(), "paused");
  cluster->advance(milliseconds(1));
  EXPECT_EQ(cluster->status().state(), "failed");
  EXPECT_THAT(cluster->status().failure(), HasSubstr("silent for 4 s"));
  EXPECT_FALSE(cluster->coordinator->suspect(kSecond, cluster->now));
  // It may come back all the same: then it must not go on by itself.
  EXPECT_EQ(cluster->take(kSecond, Kind::kRefusal).size(), 1u);
}

TEST(Suspect, OnlyTheCoordinatorThatHasAServerTakesItBack) {
  v1::ClusterMessage again;
  *again.mutable_hello() = TestCluster::hello();
  again.mutable_hello()->set_again(true);
  const auto cluster = loaded_cluster();
  cluster->coordinator->suspect(kSecond, cluster->now);
  cluster->receive(kSecond, again);
  EXPECT_FALSE(cluster->status().servers(1).suspect());
  EXPECT_EQ(cluster->take(kSecond, Kind::kWelcome).size(), 1u);

  TestCluster another;
  another.receive(kSecond, again);
  EXPECT_EQ(another.take(kSecond, Kind::kRefusal).size(), 1u);
  EXPECT_EQ(another.status().servers_size(), 0);
}

TEST(Suspect, ThatWasLoadingIsLostEarlierThanOneThatIsOnlyBusy) {
  TestCluster cluster;
  cluster.join(kFirst);
  cluster.join(kSecond);
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(small_world());
  const auto load = cluster.ask<v1::LoadReply>(request);
  cluster.coordinator->suspect(kSecond, cluster.now);
  cluster.advance(seconds(59));
  EXPECT_FALSE(load->status);
  cluster.advance(seconds(1));
  EXPECT_EQ(cluster.status().servers_size(), 1);
  cluster.finish_loads();  // the other one has it alone
  EXPECT_TRUE(load->ok()) << load->message();
}

TEST(Suspect, ACoordinatorThatStalledItselfBlamesNobody) {
  const auto cluster = loaded_cluster();
  cluster->advance(seconds(30));
  EXPECT_EQ(cluster->status().state(), "paused");
  cluster->report(kFirst, 1, 0);
  cluster->advance(seconds(1));
  EXPECT_EQ(cluster->status().state(), "failed");
  EXPECT_THAT(cluster->status().failure(), HasSubstr("server c8"));
}

TEST(LostServer, EndsTheWorldAndAnswersEveryone) {
  const auto cluster = loaded_cluster();
  const auto step = cluster->step(100);
  const auto hash = cluster->query(hash_query());
  const auto pause = cluster->ask<v1::PauseReply>(v1::PauseRequest());
  cluster->leave(kSecond);
  EXPECT_EQ(step->code(), absl::StatusCode::kFailedPrecondition);  // cut short by the pause
  EXPECT_EQ(hash->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(pause->code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(pause->message(), HasSubstr("left: told to"));
  EXPECT_EQ(cluster->apply(removal("ball"))->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(cluster->take(kFirst, Kind::kUnloadWorld).size(), 1u);
  EXPECT_EQ(cluster->status().state(), "failed");
  EXPECT_EQ(cluster->status().world(), "small");

  // The rest of the cluster goes on: another world loads on the server that is left.
  v1::LoadRequest load;
  *load.mutable_world() = to_proto(small_world());
  const auto again = cluster->ask<v1::LoadReply>(load);
  cluster->finish_loads();
  EXPECT_TRUE(again->ok());
  EXPECT_EQ(again->answer.servers(), 1u);
  EXPECT_EQ(cluster->status().state(), "paused");
  EXPECT_EQ(cluster->status().failure(), "");
}

TEST(LostServer, WithoutAPartInTheWorldIsNoLoss) {
  CoordinatorOptions options;
  options.servers_wanted = 1;
  TestCluster cluster(options);
  cluster.join(kFirst);
  cluster.join(kSecond);
  v1::LoadRequest load;
  *load.mutable_world() = to_proto(small_world());
  cluster.ask<v1::LoadReply>(load);
  cluster.finish_loads();
  cluster.leave(kSecond);
  EXPECT_EQ(cluster.status().state(), "paused");
}

TEST(LostServer, AGoodbyeSaysWhy) {
  const auto cluster = loaded_cluster();
  v1::ClusterMessage message;
  message.mutable_goodbye()->set_reason("out of coffee");
  cluster->receive(kFirst, message);
  EXPECT_THAT(cluster->status().failure(), HasSubstr("out of coffee"));
}

TEST(LostServer, SoIsOneThatRunsAheadOfItsGrants) {
  const auto cluster = loaded_cluster();
  cluster->report(kFirst, 1, 3);
  EXPECT_EQ(cluster->status().state(), "failed");
  EXPECT_THAT(cluster->status().failure(), HasSubstr("reports tick 3"));
}

TEST(Stepping, RunsExactlyTheTicksAndAnswersWhenAllServersAreDone) {
  const auto cluster = loaded_cluster();
  const auto step = cluster->step(100);
  while (!cluster->work(kFirst).empty()) {
  }
  EXPECT_FALSE(step->status);
  EXPECT_EQ(cluster->tick[kFirst], 32u);  // the window, ahead of the other server
  cluster->work_all();
  ASSERT_TRUE(step->ok());
  EXPECT_EQ(step->answer.tick(), 100u);
  EXPECT_EQ(cluster->tick[kFirst], 100u);
  EXPECT_EQ(cluster->tick[kSecond], 100u);
  const v1::StatusReply status = cluster->status();
  EXPECT_EQ(status.state(), "paused");
  EXPECT_EQ(status.tick(), 100u);
  EXPECT_DOUBLE_EQ(status.time(), 1.0);
  EXPECT_EQ(status.counts().at("clones"), 2u);
  EXPECT_EQ(status.bodies(), 4u);
  EXPECT_NEAR(status.tick_ms().p50(), 1.0, 0.01);
  EXPECT_EQ(status.servers(0).counts().at("clones"), 1u);
}

TEST(Stepping, GrantsAreNumberedWithoutAGapAndEqualForAll) {
  const auto cluster = loaded_cluster();
  cluster->step(20);
  const std::vector<v1::Grant> first = cluster->take_grants(kFirst);
  const std::vector<v1::Grant> second = cluster->take_grants(kSecond);
  ASSERT_EQ(first.size(), 3u);  // 8 + 8 + 4
  for (std::size_t n = 0; n < first.size(); ++n) {
    EXPECT_EQ(first[n].serial(), n + 1);
    EXPECT_EQ(first[n].SerializeAsString(), second[n].SerializeAsString());
  }
}

TEST(Shutdown, SaysGoodbyeToEveryone) {
  const auto cluster = loaded_cluster();
  const auto step = cluster->step(10);
  const auto end = cluster->ask<v1::ShutdownReply>(v1::ShutdownRequest());
  EXPECT_TRUE(end->ok());
  EXPECT_EQ(step->code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(cluster->coordinator->finished());
  EXPECT_EQ(cluster->take(kFirst, Kind::kGoodbye).size(), 1u);
  EXPECT_EQ(cluster->take(kSecond, Kind::kGoodbye).size(), 1u);
  EXPECT_EQ(cluster->ask<v1::StatusReply>(v1::StatusRequest())->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(cluster->coordinator->next_deadline(), std::nullopt);
}

TEST(Pacing, GrantsTicksWhenTheyAreDue) {
  const auto cluster = loaded_cluster();
  v1::ResumeRequest resume;
  resume.set_real_time_factor(0.5);  // a tick of 10 ms every 20 ms
  ASSERT_TRUE(cluster->ask<v1::ResumeReply>(resume)->ok());
  EXPECT_EQ(cluster->status().state(), "running");
  for (Tick tick = 1; tick <= 200; ++tick) {
    cluster->work_all();
    EXPECT_EQ(cluster->tick[kFirst], tick);
    ASSERT_TRUE(cluster->coordinator->next_deadline());
    EXPECT_EQ(*cluster->coordinator->next_deadline(), cluster->now + milliseconds(20));
    cluster->advance(milliseconds(20));
  }
  cluster->work_all();
  EXPECT_NEAR(cluster->status().real_time_factor(), 0.5, 0.01);
}

TEST(Pacing, ASlowWorldSlowsDownEvenly) {
  CoordinatorOptions options;
  options.server_timeout = seconds(100);
  const auto cluster = loaded_cluster(options);
  v1::ResumeRequest resume;
  resume.set_real_time_factor(1);
  cluster->ask<v1::ResumeReply>(resume);
  cluster->advance(seconds(10));
  std::uint64_t granted = 0;
  for (const v1::Grant& grant : cluster->take_grants(kFirst)) granted += grant.ticks();
  EXPECT_LE(granted, 5u);  // 50 ms worth are granted ahead, no more
  cluster->report(kFirst, 1, granted);
  cluster->report(kSecond, 1, granted);
  granted = 0;
  for (const v1::Grant& grant : cluster->take_grants(kFirst)) granted += grant.ticks();
  EXPECT_LE(granted, 5u);
}

TEST(Pacing, ResumeChecksItsFactor) {
  const auto cluster = loaded_cluster();
  for (const double factor :
       {-1.0, 1e-9, 1e9, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    v1::ResumeRequest resume;
    resume.set_real_time_factor(factor);
    const auto heard = cluster->ask<v1::ResumeReply>(resume);
    EXPECT_EQ(heard->code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(heard->message(), HasSubstr("real_time_factor"));
  }
  EXPECT_EQ(cluster->status().state(), "paused");
}

TEST(Running, AsFastAsPossibleKeepsTheWindowFull) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  for (int n = 0; n < 20; ++n) {
    cluster->work(kFirst);
    cluster->work(kSecond);
  }
  EXPECT_GT(cluster->tick[kFirst], 200u);
  EXPECT_EQ(cluster->status().state(), "running");
  const auto pause = cluster->ask<v1::PauseReply>(v1::PauseRequest());
  EXPECT_FALSE(pause->status);
  cluster->work_all();
  ASSERT_TRUE(pause->ok());
  EXPECT_EQ(pause->answer.tick(), cluster->tick[kFirst]);
  EXPECT_EQ(cluster->tick[kFirst], cluster->tick[kSecond]);
  EXPECT_EQ(cluster->status().state(), "paused");
}

}  // namespace
}  // namespace tessera
