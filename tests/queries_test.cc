// Queries and commands through the SDK, with their errors.
#include <cmath>
#include <limits>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr double kSmallSector = 10;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// One cluster for all tests; each loads its own world.
class QueriesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cluster_ = new Cluster(start_cluster(2)); }
  static void TearDownTestSuite() {
    delete cluster_;
    cluster_ = nullptr;
  }
  void SetUp() override {
    ASSERT_TRUE(cluster_->client);
    WorldDescription world = flat_world(kSmallSector);
    world.settings.gravity = UniformGravity{{0, 0, 0}};
    for (const double x : {-20.0, -10.0, 0.0, 10.0, 20.0}) {
      add(world, solid(absl::StrCat("crate_", x), box(1, 1, 1), 10, {{0, 0, 0}, {x, 0, 3}}));
    }
    ASSERT_THAT(client().load(world, true).status(), IsOk());
  }
  static Client& client() { return *cluster_->client; }

  static Cluster* cluster_;
};
Cluster* QueriesTest::cluster_ = nullptr;

TEST_F(QueriesTest, RayGoesThroughThreeSectorsOnTwoServers) {
  ASSERT_THAT(client().step(1, kPatience).status(), IsOk());
  const ClusterStatus status = client().status().value();
  for (const ServerStatus& server : status.servers) EXPECT_GT(server.bodies, 0u);
  ASSERT_THAT(
      client().teleport("crate_-10", {{{-1, 0, 0}, {0, 4, 3}}, Eigen::Quaterniond::Identity()}).status(),
      IsOk());
  ASSERT_THAT(client().teleport("crate_0", {{{0, 0, 0}, {0, 4, 3}}, Eigen::Quaterniond::Identity()}).status(),
              IsOk());
  ASSERT_THAT(client().step(1, kPatience).status(), IsOk());

  // From sector -2 over -1 and 0 to the crate in sector 1.
  const RayQuery east{{{-2, 0, 0}, {3, 0, 3}}, {2, 0, 0}, 100, 0};
  const std::optional<RayResult> hit = client().raycast(east).value();
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->name, "crate_10");
  EXPECT_NEAR(hit->distance, 17 + 9.5, 0.05);
  EXPECT_EQ(hit->position.sector, (SectorIndex{1, 0, 0}));
  EXPECT_NEAR(hit->position.local.x(), -0.5, 0.05);
  EXPECT_NEAR(hit->normal.x(), -1, 1e-3);

  EXPECT_FALSE(client().raycast({{{-2, 0, 0}, {3, 2, 3}}, {1, 0, 0}, 100, 0}).value());
  EXPECT_FALSE(client().raycast({{{-2, 0, 0}, {3, 0, 3}}, {1, 0, 0}, 26, 0}).value());
  const std::optional<RayResult> ground =
      client().raycast({{{7, -3, 0}, {0, 0, 3}}, {0, 0, -1}, 10, 0}).value();
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->name, "ground");
  EXPECT_NEAR(ground->distance, 3, 1e-3);
}

TEST_F(QueriesTest, ManyRaysAreOneQuery) {
  const BodyId crate = client().find("crate_0").value().id;
  const WorldPosition above{{0, 0, 0}, {0, 0, 8}};
  QueryList queries;
  const auto rays = queries.rays({.rays = {{above, {0, 0, -2}, 20},
                                           {above, {0, 0, -2}, 20, crate},
                                           {above, {0, 0, 1}, 20},
                                           {{{-2, 0, 0}, {3, 0, 3}}, {1, 0, 0}, 100}}});
  const auto single = queries.ray({{{-2, 0, 0}, {3, 0, 3}}, {1, 0, 0}, 100});
  const Answers answers = client().ask(queries, kPatience).value();
  const std::vector<std::optional<FirstHit>> hits = answers[rays];
  ASSERT_EQ(hits.size(), 4u);
  EXPECT_EQ(hits[0].value().body, crate);
  EXPECT_NEAR(hits[0]->distance, 4.5, 1e-4);
  EXPECT_EQ(hits[1].value().body, client().find("ground").value().id);
  EXPECT_FALSE(hits[2]);
  const std::vector<RayResult> one = answers[single];
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(hits[3].value().body, one[0].body);
  EXPECT_EQ(hits[3]->distance, one[0].distance);
  EXPECT_EQ(hits[3]->position, one[0].position);
}

TEST_F(QueriesTest, SpawnedBodyIsFoundMovedAndRemoved) {
  const Spawned ball = client().spawn(solid("ball", sphere(0.5), 2, {{5, 0, 0}, {0, 0, 4}})).value();
  EXPECT_EQ(client().find("ball").value().id, ball.id);
  EXPECT_EQ(client().find_bodies("crate_", 2).value().bodies.size(), 2u);
  EXPECT_TRUE(client().find_bodies("crate_", 2).value().truncated);
  ASSERT_THAT(client().apply_impulse(ball.id, {4, 0, 0}).status(), IsOk());
  const auto stream = client().watch_bodies({.ids = {ball.id}}, kPatience).value();
  const Tick last = client().step(60, kPatience).value();
  BodyFrame frame;
  while (frame.tick < last) frame = stream->next(kPatience).value();
  ASSERT_EQ(frame.bodies.size(), 1u);
  EXPECT_NEAR(frame.bodies[0].pose.position.local.x(), 2, 0.05);
  EXPECT_EQ(frame.bodies[0].pose.position.sector, (SectorIndex{5, 0, 0}));

  ASSERT_THAT(client().remove("ball").status(), IsOk());
  ASSERT_THAT(client().step(1).status(), IsOk());
  EXPECT_THAT(client().find("ball").status(), IsStatus(absl::StatusCode::kNotFound, "ball"));
  EXPECT_EQ(client().remove(ball.id).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(QueriesTest, KinematicBodyGoesWhereItIsTold) {
  NewBody lift = solid("lift", box(2, 2, 0.2), 1, {{0, 1, 0}, {0, 0, 1}});
  lift.body.properties.motion = Motion::kKinematic;
  ASSERT_THAT(client().spawn(lift).status(), IsOk());
  ASSERT_THAT(client().step(1).status(), IsOk());
  ASSERT_THAT(client()
                  .set_kinematic_target("lift", {{{0, 1, 0}, {0, 0, 1.1}}, Eigen::Quaterniond::Identity()})
                  .status(),
              IsOk());
  ASSERT_THAT(client().step(1).status(), IsOk());
  const auto stream = client().watch_bodies({.ids = {client().find("lift").value().id}}, kPatience).value();
  const BodyFrame frame = stream->next(kPatience).value();
  EXPECT_NEAR(frame.bodies.at(0).pose.position.local.z(), 1.1, 1e-5);
}

TEST_F(QueriesTest, NearFindsBodiesOfThreeSectorsOnTwoServers) {
  NearQuery query;
  query.pose.position = {{0, 0, 0}, {1, 0, 3}};
  query.reach = 12;
  const std::vector<Neighbour> nearest = client().near(query).value();
  ASSERT_EQ(nearest.size(), 4u);
  EXPECT_EQ(nearest[0].name, "crate_0");
  EXPECT_NEAR(nearest[0].distance, 0.5, 0.01);
  EXPECT_NEAR(nearest[1].distance, 3, 0.01) << nearest[1].name << " is the floor";
  EXPECT_EQ(nearest[2].name, "crate_10");
  EXPECT_EQ(nearest[3].name, "crate_-10");
  query.pose.position.local.x() = 0;
  query.reach = 0;
  query.probe = Box{{9, 1, 1}};
  EXPECT_EQ(client().near(query).value().size(), 1u);
  query.reach = -1;
  EXPECT_EQ(client().near(query).status().code(), absl::StatusCode::kInvalidArgument);
  query.reach = 0;
  query.probe = Plane{};
  EXPECT_FALSE(client().near(query).ok());
}

TEST_F(QueriesTest, WhatCannotBeDoneIsRefusedAndTheWorldUnchanged) {
  const std::string before = client().hash().value().hash;
  const auto code = [](const absl::Status& status) { return status.code(); };
  const WorldPosition far{{0, 0, 0}, {0, 0, 5}};
  EXPECT_EQ(code(client().spawn(solid("crate_0", box(1, 1, 1), 1, far)).status()),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(code(client().spawn(solid("a", box(1, 1, 1), -1, far)).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client().spawn(solid("b", box(0, 1, 1), 1, far)).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client().spawn(solid("c", box(30, 1, 1), 1, far)).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client().spawn(solid("d", sphere(1), 1, {{0, 0, 0}, {kNaN, 0, 0}})).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client()
                     .spawn(solid("e", sphere(1), 1,
                                  {{std::numeric_limits<std::int64_t>::max(), 0, 0}, {100, 0, 0}}))
                     .status()),
            absl::StatusCode::kOutOfRange);
  EXPECT_EQ(code(client().set_velocity("crate_0", {kNaN, 0, 0}, {0, 0, 0}).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client().set_velocity("nobody", {1, 0, 0}, {0, 0, 0}).status()),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(code(client().raycast({{{0, 0, 0}, {0, 0, 0}}, {0, 0, 0}, 10, 0}).status()),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(client().resume(-1).status()), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client().hash().value().hash, before);
  EXPECT_EQ(client().status().value().state, "paused");
}

TEST_F(QueriesTest, PauseAndResumeKeepTheTick) {
  ASSERT_THAT(client().resume().status(), IsOk());
  const auto stream = client().watch_bodies({}, kPatience).value();
  Tick seen = 0;
  while (seen < 20) seen = stream->next(kPatience).value().tick;
  const Tick paused = client().pause(kPatience).value();
  EXPECT_GE(paused, seen);
  EXPECT_EQ(client().status().value().tick, paused);
  EXPECT_EQ(client().hash().value().tick, paused);
}

}  // namespace
}  // namespace tessera
