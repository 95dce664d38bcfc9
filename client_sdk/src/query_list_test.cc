// Results of queries as users get them, and those that are refused.
#include "client_sdk/src/query_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "proto/ray_columns.h"
#include "tessera/batch.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;

// A reply with one result, and whether it is taken for one to `request`.
struct OneResult {
  std::shared_ptr<v1::Reply> reply = std::make_shared<v1::Reply>();
  v1::QueryResult& result = *reply->add_results();
  v1::Request request;

  Answers answers() const { return Answers(reply); }
  bool is_taken() const { return check_results(request, *reply).ok(); }
};

TEST(QueryList, JointsHaveTheLoadsThatWereAskedFor) {
  OneResult one;
  one.request.add_queries()->mutable_joint_states();
  v1::JointColumns& columns = *one.result.mutable_joint_states();
  for (const std::uint32_t axes : {1, 0, 2}) {
    columns.add_ids(columns.ids_size() + 1);
    columns.add_axes(axes);
    for (int n = 0; n < 6; ++n) columns.add_reactions(10 * columns.ids_size() + n);
  }
  for (int n = 1; n <= 3; ++n) {
    columns.add_positions(n);
    columns.add_rates(-n);
    columns.add_efforts(5 * n);
  }
  ASSERT_TRUE(one.is_taken());
  const std::vector<JointValues> joints = one.answers()[QueryPlace<std::vector<JointValues>>{0}];
  ASSERT_EQ(joints.size(), 3u);
  EXPECT_THAT(joints[0].efforts, ElementsAre(5));
  EXPECT_THAT(joints[1].efforts, ElementsAre());
  EXPECT_THAT(joints[2].efforts, ElementsAre(10, 15));
  EXPECT_EQ(joints[1].force, Eigen::Vector3d(20, 21, 22));
  EXPECT_EQ(joints[2].torque, Eigen::Vector3d(33, 34, 35));
  columns.add_efforts(1);
  EXPECT_FALSE(one.is_taken());
}

TEST(QueryList, DynamicsHaveMatricesByRows) {
  OneResult one;
  one.request.add_queries()->mutable_dynamics();
  v1::Dynamics& dynamics = *one.result.mutable_dynamics();
  dynamics.set_base(7);
  dynamics.add_joints(3);
  dynamics.add_freedoms(2);
  for (int n = 0; n < 2; ++n) {
    dynamics.add_velocities(n);
    dynamics.add_bias(10 + n);
  }
  for (int n = 0; n < 4; ++n) dynamics.add_mass_matrix(n);
  for (int n = 0; n < 24; ++n) dynamics.add_jacobians(n);
  ASSERT_TRUE(one.is_taken());
  const Dynamics found = one.answers()[QueryPlace<Dynamics>{0}];
  EXPECT_EQ(found.base, BodyId{7});
  EXPECT_THAT(found.freedoms, ElementsAre(2));
  EXPECT_EQ(found.bias, Eigen::Vector2d(10, 11));
  EXPECT_EQ(found.efforts.size(), 0);
  EXPECT_EQ(found.mass_matrix(0, 1), 1);
  ASSERT_EQ(found.jacobians.size(), 2u);
  EXPECT_EQ(found.jacobians[1](0, 1), 13) << "by rows of two";
  dynamics.add_jacobians(1);
  EXPECT_FALSE(one.is_taken());
}

TEST(QueryList, ADistanceBeyondTheReachIsNone) {
  OneResult one;
  one.request.add_queries()->mutable_distance();
  v1::Distance& distance = *one.result.mutable_distance();
  distance.set_distance(2.5);
  distance.mutable_normal()->set_x(-1);
  ASSERT_TRUE(one.is_taken());
  const QueryPlace<std::optional<BodyDistance>> place{0};
  ASSERT_TRUE(one.answers()[place]);
  EXPECT_EQ(one.answers()[place]->distance, 2.5);
  EXPECT_EQ(one.answers()[place]->normal.x(), -1);
  distance.set_beyond(true);
  EXPECT_FALSE(one.answers()[place]);
}

TEST(QueryList, RaysInColumnsHaveAHitOrNoneEach) {
  QueryList queries;
  RaysQuery rays;
  rays.rays.resize(2);
  const auto place = queries.rays(rays);
  EXPECT_EQ(queries.size(), 1u);
  OneResult one;
  RayWriter asked(*one.request.add_queries()->mutable_rays());
  HitWriter hits(*one.result.mutable_rays());
  asked.add({});
  hits.add({});
  asked.add({});
  EXPECT_FALSE(one.is_taken()) << "a ray has no result";
  hits.add({BodyId{3}, 2.5, {{1, 0, 0}, {1, 2, 3}}, {0, 0, 1}});
  ASSERT_TRUE(one.is_taken());
  const std::vector<std::optional<FirstHit>> found = one.answers()[place];
  ASSERT_EQ(found.size(), 2u);
  EXPECT_FALSE(found[0]);
  ASSERT_TRUE(found[1]);
  EXPECT_EQ(found[1]->body, BodyId{3});
  EXPECT_EQ(found[1]->distance, 2.5);
  EXPECT_EQ(found[1]->position, (WorldPosition{{1, 0, 0}, {1, 2, 3}}));
  one.result.mutable_rays()->add_distances(1);
  EXPECT_FALSE(one.is_taken());
}

TEST(QueryList, ContactsComeWithTheirPoints) {
  OneResult one;
  one.request.add_queries()->mutable_contacts();
  v1::Contact& contact = *one.result.mutable_contacts()->add_contacts();
  contact.set_phase(v1::Contact::PERSIST);
  contact.set_a(1);
  contact.set_b(2);
  for (const double coordinate : {0.1, 0.2, 0.3}) contact.add_points(coordinate);
  contact.add_depths(0.01);
  contact.add_impulses(4);
  one.result.mutable_contacts()->set_truncated(true);
  ASSERT_TRUE(one.is_taken());
  const FoundContacts found = one.answers()[QueryPlace<FoundContacts>{0}];
  EXPECT_TRUE(found.truncated);
  ASSERT_EQ(found.contacts.size(), 1u);
  EXPECT_EQ(found.contacts[0].phase, ContactPhase::kPersist);
  ASSERT_EQ(found.contacts[0].points.size(), 1u);
  EXPECT_EQ(found.contacts[0].points[0].offset, Eigen::Vector3d(0.1, 0.2, 0.3));
}

}  // namespace
}  // namespace tessera
