// Lists of queries: what is refused, what servers are asked, and what comes of their answers.
#include "coordinator/asked_queries.h"

#include <cmath>
#include <limits>
#include <map>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/base/rotation.h"
#include "lpss/model/limits.h"
#include "lpss/observe/world_hash.h"
#include "proto/body_columns.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Query ray(v1::RayQuery::Wanted wanted = v1::RayQuery::FIRST) {
  v1::Query query;
  *query.mutable_ray()->mutable_origin() = to_proto(WorldPosition{});
  *query.mutable_ray()->mutable_direction() = xyz(1e-200, 0, 0);
  query.mutable_ray()->set_length(1000);
  query.mutable_ray()->set_wanted(wanted);
  return query;
}

v1::Geometry ball_of(double radius) {
  v1::Geometry geometry;
  geometry.mutable_sphere()->set_radius(radius);
  return geometry;
}

v1::Query sweep() {
  v1::Query query;
  *query.mutable_sweep()->mutable_pose() = to_proto(WorldPose{});
  *query.mutable_sweep()->mutable_probe() = ball_of(0.5);
  *query.mutable_sweep()->mutable_direction() = xyz(0, 0, -2);
  query.mutable_sweep()->set_length(10);
  return query;
}

v1::Query near(std::uint64_t limit = 0) {
  v1::Query query;
  *query.mutable_near()->mutable_pose() = to_proto(WorldPose{});
  query.mutable_near()->set_reach(20);
  query.mutable_near()->set_limit(limit);
  return query;
}

v1::Query states(const std::vector<std::uint64_t>& ids = {}, const std::string& prefix = "") {
  v1::Query query;
  query.mutable_states()->mutable_ids()->Add(ids.begin(), ids.end());
  query.mutable_states()->set_name_prefix(prefix);
  return query;
}

v1::Query joint_states(const std::vector<std::uint64_t>& ids = {}, const std::string& prefix = "") {
  v1::Query query;
  query.mutable_joint_states()->mutable_ids()->Add(ids.begin(), ids.end());
  query.mutable_joint_states()->set_name_prefix(prefix);
  return query;
}

// What each server says it hits, by body.
using Distances = std::map<NodeId, std::vector<std::pair<std::uint64_t, double>>>;

// Answers with the same to each ray or sweep, and to what is near.
std::function<v1::PartialResult(NodeId, const v1::Query&)> knowing(const Distances& distances) {
  return [distances](NodeId node, const v1::Query& query) {
    v1::PartialResult part;
    const auto found = distances.find(node);
    if (found == distances.end()) return part;
    v1::QueryResult& result = *part.mutable_result();
    for (const auto& [body, distance] : found->second) {
      if (query.has_near()) {
        v1::NearBodies::Found& near = *result.mutable_near()->add_bodies();
        near.set_id(body);
        near.set_distance(distance);
        continue;
      }
      v1::RayHits& hits = query.has_ray() ? *result.mutable_ray() : *result.mutable_sweep();
      v1::RayHits::Hit& hit = *hits.add_hits();
      hit.set_body(body);
      hit.set_distance(distance);
      *hit.mutable_normal() = xyz(-1, 0, 0);
    }
    return part;
  };
}

// Answered by all servers.
v1::Reply answered(TestCluster& cluster, const std::vector<v1::Query>& queries) {
  const HeardReply heard = cluster.query(queries);
  cluster.work_all();
  EXPECT_TRUE(heard->ok()) << heard->message();
  EXPECT_EQ(heard->answer.results_size(), static_cast<int>(queries.size()));
  return heard->answer;
}

TEST(Queries, HashesAreSummedOverServers) {
  const auto cluster = loaded_cluster();
  cluster->step(3);
  cluster->work_all();
  const auto hash = cluster->query(hash_query());
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].ticks(), 0u);
  EXPECT_FALSE(hash->status);
  cluster->work(kSecond);
  ASSERT_TRUE(hash->ok());
  EXPECT_EQ(hash->answer.tick(), 3u);
  WorldHash sum(3, kFirst.value);
  sum.add(WorldHash(3, kSecond.value));
  EXPECT_EQ(hash->answer.results(0).hash().hash(), sum.to_string());
}

// Results come in the order of the queries, whoever knows them.
TEST(Queries, OfAListAreAnsweredAtOneTick) {
  const auto cluster = loaded_cluster();
  v1::Query find;
  find.mutable_find_bodies()->set_name_prefix("b");
  const auto heard = cluster->query({hash_query(), find, ray(), near(), hash_query()});
  const std::vector<v1::Grant> grants = cluster->take_grants(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  ASSERT_EQ(grants[0].questions_size(), 1) << "servers are asked once";
  EXPECT_EQ(grants[0].questions(0).queries().all_size(), 4);
  cluster->inbox[kFirst].emplace_back().mutable_grant()->CopyFrom(grants[0]);
  cluster->work_all();
  ASSERT_TRUE(heard->ok()) << heard->message();
  ASSERT_EQ(heard->answer.results_size(), 5);
  EXPECT_TRUE(heard->answer.results(0).has_hash());
  EXPECT_EQ(heard->answer.results(1).find_bodies().bodies(0).name(), "ball");
  EXPECT_TRUE(heard->answer.results(2).has_ray());
  EXPECT_TRUE(heard->answer.results(3).has_near());
  EXPECT_EQ(heard->answer.results(4).hash().hash(), heard->answer.results(0).hash().hash());
}

TEST(Queries, WhatTheCoordinatorKnowsIsAnsweredAtOnce) {
  const auto cluster = loaded_cluster();
  v1::Query find;
  find.mutable_find_bodies();
  const auto heard = cluster->query({find, find});
  EXPECT_TRUE(heard->ok()) << heard->message();
  EXPECT_EQ(heard->answer.results_size(), 2);
  EXPECT_TRUE(cluster->take_grants(kFirst).empty());
  EXPECT_TRUE(cluster->send(v1::Request())->ok()) << "as is a request for nothing";
}

TEST(Rays, TheNearestHitWinsAndTheSmallestIdAmongEquals) {
  const auto cluster = loaded_cluster();
  cluster->knows = knowing({{kFirst, {{4, 520}}}, {kSecond, {{1, 3}, {2, 4}}}});
  const v1::RayHits far = answered(*cluster, {ray()}).results(0).ray();
  ASSERT_EQ(far.hits_size(), 1);
  EXPECT_TRUE(far.hit());
  EXPECT_EQ(far.hits(0).name(), "floor");
  EXPECT_EQ(far.hits(0).distance(), 3);
  EXPECT_EQ(far.hits(0).normal().x(), -1);
  cluster->knows = knowing({{kFirst, {{4, 520}}}, {kSecond, {{3, 520}}}});
  const v1::RayHits tie = answered(*cluster, {ray()}).results(0).ray();
  ASSERT_EQ(tie.hits_size(), 1);
  EXPECT_EQ(tie.hits(0).body(), 3u);
  EXPECT_EQ(from_proto(tie.hits(0).position()), (WorldPosition{{5, 0, 0}, {20, 0, 0}}));
  cluster->knows = knowing({});
  const v1::RayHits miss = answered(*cluster, {ray()}).results(0).ray();
  EXPECT_FALSE(miss.hit());
  EXPECT_TRUE(miss.hits().empty());
}

TEST(Rays, OfAllHitsEachBodyCountsOnce) {
  const auto cluster = loaded_cluster();
  cluster->knows = knowing({{kFirst, {{4, 520}, {1, 3}}}, {kSecond, {{1, 3}, {2, 7}}}});
  const v1::RayHits all = answered(*cluster, {ray(v1::RayQuery::ALL)}).results(0).ray();
  EXPECT_TRUE(all.hit());
  ASSERT_EQ(all.hits_size(), 3);
  const std::vector<std::string> names = {"floor", "ball", "egg"};
  for (int n = 0; n < 3; ++n) EXPECT_EQ(all.hits(n).name(), names[static_cast<std::size_t>(n)]);
}

TEST(Rays, WhetherThereIsAnyHitIsAllThatSomeWant) {
  const auto cluster = loaded_cluster();
  cluster->knows = knowing({{kSecond, {{2, 7}}}});
  const v1::RayHits any = answered(*cluster, {ray(v1::RayQuery::ANY)}).results(0).ray();
  EXPECT_TRUE(any.hit());
  EXPECT_TRUE(any.hits().empty());
  cluster->knows = knowing({});
  EXPECT_FALSE(answered(*cluster, {ray(v1::RayQuery::ANY)}).results(0).ray().hit());
}

TEST(Sweeps, AreOfTheFirstBodyThatIsMet) {
  const auto cluster = loaded_cluster();
  cluster->knows = knowing({{kFirst, {{4, 6}}}, {kSecond, {{1, 3}}}});
  const v1::Reply reply = answered(*cluster, {sweep()});
  const v1::RayHits& hits = reply.results(0).sweep();
  ASSERT_EQ(hits.hits_size(), 1);
  EXPECT_EQ(hits.hits(0).body(), 1u);
  EXPECT_EQ(from_proto(hits.hits(0).position()).local.z(), -3) << "where the probe is by then";
}

// Directions have unit length, and bodies are known by their ids; who is gone is not excepted.
TEST(Rays, ServersAreAskedWhatTheyKnow) {
  const auto cluster = loaded_cluster();
  v1::Query query = ray();
  query.mutable_ray()->add_except()->set_name("egg");
  query.mutable_ray()->add_except()->set_id(2);
  query.mutable_ray()->add_except()->set_name("nobody");
  query.mutable_ray()->add_except()->set_id(99);
  query.mutable_ray()->add_except()->set_name("ball");
  v1::Query masked = ray();
  masked.mutable_ray()->set_mask(6);
  cluster->query({query, masked, near(), sweep()});
  const v1::Queries asked = cluster->take_grants(kFirst).at(0).questions(0).queries();
  ASSERT_EQ(asked.all_size(), 4);
  EXPECT_DOUBLE_EQ(asked.all(0).ray().direction().x(), 1);
  EXPECT_EQ(asked.all(0).ray().mask(), 0xffffffffu);
  ASSERT_EQ(asked.all(0).ray().except_size(), 2);
  EXPECT_EQ(asked.all(0).ray().except(0).id(), 2u);
  EXPECT_EQ(asked.all(0).ray().except(1).id(), 4u);
  EXPECT_EQ(asked.all(1).ray().mask(), 6u);
  EXPECT_TRUE(asked.all(2).near().probe().has_sphere()) << "a point";
  EXPECT_EQ(asked.all(2).near().limit(), kFoundBodiesDefault);
  EXPECT_DOUBLE_EQ(asked.all(3).sweep().direction().z(), -1);
}

TEST(Near, BodiesAscendByTheirDistanceAndCountOnce) {
  const auto cluster = loaded_cluster();
  cluster->knows = knowing({{kFirst, {{4, 5}, {1, 2}, {3, 2}}}, {kSecond, {{1, 2}, {2, 0}}}});
  const v1::Reply reply = answered(*cluster, {near(), near(2), near(4)});
  const v1::NearBodies& all = reply.results(0).near();
  std::vector<std::string> names;
  for (const auto& found : all.bodies()) names.push_back(found.name());
  EXPECT_THAT(names, ElementsAre("ball", "floor", "lift", "egg"));
  EXPECT_EQ(all.bodies(3).distance(), 5);
  EXPECT_FALSE(all.truncated());
  EXPECT_EQ(reply.results(1).near().bodies_size(), 2);
  EXPECT_TRUE(reply.results(1).near().truncated());
  EXPECT_EQ(reply.results(2).near().bodies_size(), 4);
  EXPECT_FALSE(reply.results(2).near().truncated()) << "as many as there are";
}

// The bodies of the small world as the server of their sector has them.
std::function<v1::PartialResult(NodeId, const v1::Query&)> hosting(
    const std::map<NodeId, std::vector<BodyRow>>& rows) {
  return [rows](NodeId node, const v1::Query& query) {
    v1::PartialResult part;
    const auto& ids = query.states().ids();
    ColumnWriter writer(*part.mutable_result()->mutable_states());
    for (const BodyRow& row : rows.at(node)) {
      if (ids.empty() || std::find(ids.begin(), ids.end(), row.id.value) != ids.end()) writer.add(row);
    }
    return part;
  };
}

BodyRow row(std::uint64_t id, const WorldPose& pose) {
  return {BodyId{id}, pose, Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(0, 0, static_cast<double>(id)),
          id == 2};
}

std::vector<std::uint64_t> ids_in(const v1::BodyColumns& columns) {
  return {columns.ids().begin(), columns.ids().end()};
}

TEST(States, AreMergedById) {
  const auto cluster = loaded_cluster();
  cluster->knows = hosting({{kFirst, {row(4, {{{5, 0, 0}, {1, 0, 0}}}), row(2, {{{}, {0, 0, 5}}})}},
                            {kSecond, {row(3, {{{5, 0, 0}, {2, 0, 0}}})}}});
  const v1::Reply reply = answered(*cluster, {states(), states({3, 99}), states({}, "e"), states({3}, "e"),
                                              states({99}), states({}, "nobody")});
  const v1::BodyColumns& all = reply.results(0).states();
  EXPECT_THAT(ids_in(all), ElementsAre(2, 3, 4));
  EXPECT_EQ(all.sectors_size(), 2);
  std::vector<BodyRow> rows;
  ASSERT_TRUE(append_rows(all, rows).ok());
  EXPECT_EQ(rows[1].pose.position, (WorldPosition{{5, 0, 0}, {2, 0, 0}}));
  EXPECT_EQ(rows[2].linear_velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(rows[2].angular_velocity, Eigen::Vector3d(0, 0, 4));
  EXPECT_TRUE(rows[0].asleep);
  EXPECT_FALSE(rows[1].asleep);
  EXPECT_THAT(ids_in(reply.results(1).states()), ElementsAre(3));
  EXPECT_THAT(ids_in(reply.results(2).states()), ElementsAre(4));
  EXPECT_THAT(ids_in(reply.results(3).states()), ElementsAre(3, 4));
  EXPECT_THAT(ids_in(reply.results(4).states()), ElementsAre()) << "an unknown id does not mean all";
  EXPECT_THAT(ids_in(reply.results(5).states()), ElementsAre());
}

// Those of a prefix are not static; an id may be of any body.
TEST(States, OfStaticBodiesAreToldByTheirIds) {
  const auto cluster = loaded_cluster();
  cluster->query({states({1}), states({}, "f")});
  const v1::Queries asked = cluster->take_grants(kFirst).at(0).questions(0).queries();
  EXPECT_THAT(asked.all(0).states().ids(), ElementsAre(0, 1));
  EXPECT_THAT(asked.all(1).states().ids(), ElementsAre(0));
}

TEST(States, ThatAreMalformedAreSaidSo) {
  const auto cluster = loaded_cluster();
  cluster->knows = [](NodeId, const v1::Query&) {
    v1::PartialResult part;
    part.mutable_result()->mutable_states()->add_ids(2);
    return part;
  };
  const auto heard = cluster->query(states());
  cluster->work_all();
  EXPECT_EQ(heard->code(), absl::StatusCode::kDataLoss) << heard->message();
}

// A hinge, whose child is on another server and in another sector, and a slide of the world's.
class JointStates : public ::testing::Test {
 protected:
  JointStates() {
    v1::Command slide = hinge("slide", "", "ball");
    v1::JointProperties& properties = *slide.mutable_add_joint()->mutable_joint()->mutable_properties();
    properties.set_type(v1::JOINT_PRISMATIC);
    *properties.mutable_anchor() = to_proto(SectorIndex{1, 0, 0});
    EXPECT_TRUE(cluster_->apply({hinge("pin", "lift", "egg"), slide})->ok());
    const Eigen::Quaterniond turned = rotation_by({0.75, 0, 0});
    cluster_->knows = hosting({{kFirst, {row(2, {{{}, {40, 0, 0}}}), row(3, {{{5, 0, 0}, {49, 0, 0}}})}},
                               {kSecond, {row(4, {{{6, 0, 0}, {-49, 0, 0}}, turned})}}});
  }

  std::unique_ptr<TestCluster> cluster_ = loaded_cluster();
};

TEST_F(JointStates, FollowFromTheStatesOfTheirBodies) {
  const v1::JointColumns columns = answered(*cluster_, {joint_states()}).results(0).joint_states();
  EXPECT_THAT(columns.ids(), ElementsAre(1, 2));
  EXPECT_THAT(columns.axes(), ElementsAre(1, 1));
  ASSERT_EQ(columns.positions_size(), 2);
  EXPECT_NEAR(columns.positions(0), 0.75, 1e-9);
  EXPECT_NEAR(columns.positions(1), -60, 1e-9) << "from the centre of sector (1, 0, 0)";
  EXPECT_NEAR(columns.rates(0), 0, 1e-9) << "they spin about z";
  EXPECT_NEAR(columns.rates(1), 1, 1e-9);
}

TEST_F(JointStates, OfSomeJoints) {
  const v1::Reply reply = answered(
      *cluster_, {joint_states({2, 77}), joint_states({}, "p"), joint_states({2}, "p"), joint_states({77})});
  EXPECT_THAT(reply.results(0).joint_states().ids(), ElementsAre(2));
  EXPECT_THAT(reply.results(1).joint_states().ids(), ElementsAre(1));
  EXPECT_THAT(reply.results(2).joint_states().ids(), ElementsAre(1, 2));
  EXPECT_THAT(reply.results(3).joint_states().ids(), ElementsAre());
}

// The world may be a command ahead of the tick of the states.
TEST_F(JointStates, OfBodiesThatAreGoneAreLeftOut) {
  const auto removed_later = cluster_->query(joint_states());
  EXPECT_TRUE(cluster_->apply(removal("egg"))->ok());
  cluster_->work_all();
  ASSERT_TRUE(removed_later->ok()) << removed_later->message();
  EXPECT_THAT(removed_later->answer.results(0).joint_states().ids(), ElementsAre(2));
}

// A request of queries alone, with errors that name the field and the bound, and nobody is asked.
class BadQueries : public ::testing::Test {
 protected:
  void expect(const v1::Query& query, absl::StatusCode code, const std::string& words) {
    const auto heard = cluster_->query(query);
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
    EXPECT_TRUE(cluster_->inbox[kFirst].empty());
  }

  std::unique_ptr<TestCluster> cluster_ = loaded_cluster();
  const std::int64_t end_ = std::numeric_limits<std::int64_t>::max();
};

TEST_F(BadQueries, Rays) {
  v1::Query query = ray();
  *query.mutable_ray()->mutable_direction() = xyz(0, 0, 0);
  expect(query, kInvalid, "direction = (0, 0, 0) must not be zero");
  *query.mutable_ray()->mutable_direction() = xyz(0, kNan, 0);
  expect(query, kInvalid, "direction y");
  for (const double length : {0.0, -1.0, 2 * kRayLengthMax, kNan}) {
    query = ray();
    query.mutable_ray()->set_length(length);
    expect(query, kInvalid, "length");
  }
  query = ray();
  query.mutable_ray()->clear_origin();
  expect(query, kInvalid, "origin must be set");
  query = ray();
  query.mutable_ray()->mutable_origin()->mutable_sector()->set_i(end_);
  expect(query, absl::StatusCode::kOutOfRange, "the end of the way");
  expect(ray(static_cast<v1::RayQuery::Wanted>(9)), kInvalid, "wanted = 9 must be FIRST, ALL or ANY");
}

TEST_F(BadQueries, SweepsAndWhatIsNear) {
  v1::Query query = sweep();
  query.mutable_sweep()->clear_pose();
  expect(query, kInvalid, "pose must be set");
  query = sweep();
  query.mutable_sweep()->clear_probe();
  expect(query, kInvalid, "probe must be set");
  query = sweep();
  query.mutable_sweep()->mutable_probe()->mutable_sphere()->set_radius(-1);
  expect(query, kInvalid, "radius = -1");
  query = sweep();
  query.mutable_sweep()->mutable_probe()->mutable_plane()->mutable_normal()->set_z(1);
  expect(query, kInvalid, "plane");
  query = sweep();
  *query.mutable_sweep()->mutable_direction() = xyz(0, 0, 0);
  expect(query, kInvalid, "direction");
  query = near();
  query.mutable_near()->clear_pose();
  expect(query, kInvalid, "pose must be set");
  for (const double reach : {-1.0, kReachMax * 100 + 1, kNan}) {
    query = near();
    query.mutable_near()->set_reach(reach);
    expect(query, kInvalid, "m must be 0 m to 4 sectors, which are 400 m");
  }
  query = near();
  *query.mutable_near()->mutable_pose() = to_proto(WorldPose{{{}, {kNan, 0, 0}}});
  expect(query, kInvalid, "pose x");
}

TEST_F(BadQueries, AreNamedByTheirPlaces) {
  v1::Query bad = ray();
  bad.mutable_ray()->set_length(0);
  const auto heard = cluster_->query({hash_query(), near(), bad});
  EXPECT_EQ(heard->code(), kInvalid);
  EXPECT_EQ(heard->message().rfind("queries[2] (ray): length = 0", 0), 0u) << heard->message();
  EXPECT_EQ(cluster_->query({hash_query(), v1::Query()})->message(), "queries[1]: a query of no known kind");
  EXPECT_TRUE(cluster_->inbox[kFirst].empty());
  v1::Request many;
  for (int n = 0; n <= kQueriesPerListMax; ++n) many.add_queries()->mutable_hash();
  EXPECT_THAT(cluster_->send(many)->message(), HasSubstr("queries: 100001 elements must be at most 100000"));
}

TEST(Queries, ARayPassesThroughALimitedNumberOfSectors) {
  WorldDescription world = small_world();
  world.bodies.resize(2);
  world.settings.sector_size = 10;
  const auto cluster = loaded_cluster({}, world);
  v1::Query query = ray();
  query.mutable_ray()->set_length(kRaySectorsMax * 10 + 1);
  const auto refused = cluster->query(query);
  EXPECT_EQ(refused->code(), kInvalid);
  EXPECT_THAT(refused->message(), HasSubstr("at most 655360 m"));
  query.mutable_ray()->set_length(kRaySectorsMax * 10);
  cluster->query(query);
  EXPECT_EQ(cluster->take_grants(kFirst).at(0).questions_size(), 1);
}

// One request is no more work than a bound, however it is divided among queries.
TEST(Queries, TakeSoMuchWorkInAll) {
  WorldDescription world = small_world();
  world.bodies.resize(2);
  world.settings.sector_size = 10;
  const auto cluster = loaded_cluster({}, world);
  v1::Request request;
  for (std::uint64_t n = 0; n < kIdsPerRequestMax; ++n) {
    if (n % 1000 == 0) request.add_queries()->mutable_find_bodies();
    request.mutable_queries()->rbegin()->mutable_find_bodies()->add_ids(n);
  }
  EXPECT_TRUE(cluster->send(request)->ok());
  request.add_queries()->mutable_states()->add_ids(1);
  EXPECT_THAT(cluster->send(request)->message(), HasSubstr("queries: 262145 ids must be at most 262144"));

  v1::Query query = ray();
  query.mutable_ray()->set_length(kRaySectorsMax * 10);
  std::vector<v1::Query> rays(kWaySectorsPerRequestMax / static_cast<std::uint64_t>(kRaySectorsMax), query);
  EXPECT_FALSE(cluster->query(rays)->status) << "it is asked";
  rays.push_back(query);
  const auto refused = cluster->query(rays);
  EXPECT_EQ(refused->code(), kInvalid);
  EXPECT_THAT(refused->message(), HasSubstr("327680 sectors in all, and may pass through 262144"));
}

TEST(Queries, SoManyWaitAtATime) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  v1::Request request = request_of({}, 0, {hash_query()});
  request.set_after(1'000'000);
  std::vector<HeardReply> waiting;
  for (std::size_t n = 0; n < kOpenQuestionsMax; ++n) waiting.push_back(cluster->send(request));
  EXPECT_FALSE(waiting.back()->status);
  EXPECT_EQ(cluster->send(request)->code(), absl::StatusCode::kResourceExhausted);
  cluster->ask<v1::UnloadReply>(v1::UnloadRequest());
  for (const HeardReply& heard : waiting) EXPECT_EQ(heard->code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace tessera
