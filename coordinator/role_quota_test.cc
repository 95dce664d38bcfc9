// Clients of role observe have a share of the time while the world ticks, and are told what it is.
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr auto kTooMuch = absl::StatusCode::kResourceExhausted;

// A world on two servers, whose work on queries takes as long as the test says; clients have roles.
class RoleQuota : public testing::Test {
 protected:
  RoleQuota() : cluster_(loaded_cluster(options())) {
    cluster_->work_us = [this](NodeId) { return server_work_us_; };
    cluster_->role = ClientRole::kObserve;
  }

  CoordinatorOptions options() {
    CoordinatorOptions options;
    options.work_clock = [this] { return work_clock_ += look_takes_; };
    return options;
  }

  void run() {
    cluster_->role = ClientRole::kControl;
    cluster_->ask<v1::ResumeReply>(v1::ResumeRequest());
    cluster_->role = ClientRole::kObserve;
  }
  // A hash, asked of the servers and answered by them.
  HeardReply hash() {
    HeardReply heard = cluster_->query(hash_query());
    for (int n = 0; n < 3; ++n) {
      for (const NodeId node : cluster_->nodes()) cluster_->work(node);
    }
    return heard;
  }
  const RoleWork::Costs& costs(ClientRole role) const {
    return cluster_->coordinator->costs_by_role()[static_cast<std::size_t>(role)];
  }

  Nanoseconds work_clock_{};
  Nanoseconds look_takes_{};
  std::uint64_t server_work_us_ = 0;
  std::unique_ptr<TestCluster> cluster_;
};

TEST_F(RoleQuota, WhatServersDidForObserversIsPaidForByTheNextOfThem) {
  run();
  server_work_us_ = 150'000;
  ASSERT_TRUE(hash()->ok());
  const HeardReply refused = cluster_->query(hash_query());
  EXPECT_EQ(refused->code(), kTooMuch);
  EXPECT_THAT(refused->message(), HasSubstr("role observe"));
  EXPECT_THAT(refused->message(), HasSubstr("20 %"));
  EXPECT_THAT(refused->message(), HasSubstr("ask again in 500 ms"));
  EXPECT_EQ(cluster_->status().state(), "running") << "which they may always ask for";
  cluster_->advance(milliseconds(500));
  EXPECT_TRUE(hash()->ok());
  EXPECT_EQ(costs(ClientRole::kObserve).requests, 4u);
  EXPECT_EQ(costs(ClientRole::kObserve).refused, 1u);
  EXPECT_EQ(costs(ClientRole::kObserve).work, milliseconds(300)) << "of the server that took longest";
}

TEST_F(RoleQuota, OtherRolesDoNotWaitForObservers) {
  run();
  server_work_us_ = 10'000'000;
  ASSERT_TRUE(hash()->ok());
  EXPECT_EQ(cluster_->query(hash_query())->code(), kTooMuch);
  cluster_->role = ClientRole::kControl;
  EXPECT_TRUE(cluster_->apply(push("ball"))->ok());
  EXPECT_TRUE(hash()->ok());
  EXPECT_EQ(costs(ClientRole::kControl).refused, 0u);
}

TEST_F(RoleQuota, APausedWorldHasTimeForAll) {
  server_work_us_ = 10'000'000;
  for (int n = 0; n < 3; ++n) EXPECT_TRUE(hash()->ok());
}

TEST_F(RoleQuota, TimeOfTheCoordinatorCountsToo) {
  run();
  look_takes_ = milliseconds(60);
  v1::Query find;
  find.mutable_find_bodies();
  EXPECT_TRUE(cluster_->query(find)->ok());
  EXPECT_EQ(cluster_->query(find)->code(), kTooMuch);
}

// Queries of one request are looked at for so long at a stretch.
TEST_F(RoleQuota, ALongListEndsWithTheStretch) {
  run();
  v1::Query find;
  find.mutable_find_bodies();
  look_takes_ = kObserveStretchMax / 2;
  const HeardReply refused = cluster_->query(std::vector<v1::Query>(5, find));
  EXPECT_EQ(refused->code(), kTooMuch);
  EXPECT_THAT(refused->message(), HasSubstr("10 ms between two ticks"));
  EXPECT_EQ(costs(ClientRole::kObserve).refused, 1u);
  cluster_->role = ClientRole::kControl;
  EXPECT_TRUE(cluster_->query(std::vector<v1::Query>(5, find))->ok());
}

TEST_F(RoleQuota, ServersGetTheBoundWhereThereIsOne) {
  const auto bound_of = [&](ClientRole role) {
    cluster_->role = role;
    cluster_->query(hash_query());
    std::uint64_t bound = 0;
    for (const v1::Grant& grant : cluster_->work(kFirst)) {
      for (const v1::Question& question : grant.questions()) bound = question.queries().work_us_max();
    }
    cluster_->work(kSecond);
    return bound;
  };
  EXPECT_EQ(bound_of(ClientRole::kObserve), 0u) << "paused";
  run();
  EXPECT_EQ(bound_of(ClientRole::kObserve),
            static_cast<std::uint64_t>(std::chrono::microseconds(kObserveStretchMax).count()));
  EXPECT_EQ(bound_of(ClientRole::kControl), 0u);
}

TEST_F(RoleQuota, WhatIsBeyondABoundOfAServerIsRefused) {
  run();
  cluster_->excess = v1::Answer::WORK;
  HeardReply refused = hash();
  EXPECT_EQ(refused->code(), kTooMuch);
  EXPECT_THAT(refused->message(), HasSubstr("10 ms between two ticks"));
  cluster_->excess = v1::Answer::BYTES;
  refused = hash();
  EXPECT_EQ(refused->code(), kTooMuch);
  EXPECT_THAT(refused->message(), HasSubstr("ask for less at once"));
  EXPECT_EQ(costs(ClientRole::kObserve).refused, 2u);
  cluster_->excess = v1::Answer::NONE;
  EXPECT_TRUE(hash()->ok());
}

}  // namespace
}  // namespace tessera
