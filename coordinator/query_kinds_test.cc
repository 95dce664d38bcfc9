// Queries whose results the coordinator makes of what several servers know: contacts, distances, dynamics,
// and loads of joints.
#include "coordinator/query_kinds.h"

#include <map>
#include <set>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "coordinator/test_mutations.h"
#include "proto/body_columns.h"
#include "proto/ray_columns.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A world of dynamic balls of 2 kg ("b1" and so on), 1 m apart from x = 1 on, on each side of a border of
// sectors of 100 m, and the servers that host them.
class QueryKinds : public ::testing::Test {
 protected:
  static constexpr double kMass = 2;
  static constexpr double kMoment = 0.3;

  static WorldDescription balls() {
    WorldDescription world;
    world.name = "balls";
    world.settings.sector_size = 100;
    world.shapes = {Shape{{{Sphere{0.25}, {}}}}, Shape{{{Plane{}, {}}}}};
    for (int n = 1; n <= 4; ++n) {
      BodyDescription& body = world.bodies.emplace_back();
      body.name = "b" + std::to_string(n);
      body.properties.mass = kMass;
      body.properties.inertia = {kMoment, kMoment, kMoment};
      body.pose = place(n);
    }
    BodyDescription& ground = world.bodies.emplace_back();
    ground.name = "ground";
    ground.properties.motion = Motion::kStatic;
    ground.properties.shape = 1;
    ground.pose.position.local.z() = -2;
    return world;
  }

  // The first two in sector 0, the others in sector (1, 0, 0).
  static WorldPose place(int n) {
    const double x = n + 47.5;
    return n <= 2 ? WorldPose{{{0, 0, 0}, {x, 0, 0}}} : WorldPose{{{1, 0, 0}, {x - 100, 0, 0}}};
  }

  QueryKinds() {
    cluster_->knows = [this](NodeId node, const v1::Query& query) {
      v1::PartialResult part;
      v1::QueryResult& result = *part.mutable_result();
      const bool is_first = node == kFirst;
      if (query.has_states()) {
        ColumnWriter writer(*result.mutable_states());
        for (const std::uint64_t id : query.states().ids()) {
          const bool is_here = id == 5 ? is_first : id >= 1 && id <= 4 && (id <= 2) == is_first;
          if (is_here) writer.add({BodyId{id}, id == 5 ? WorldPose{{{}, {0, 0, -2}}} : place(int(id))});
        }
      } else if (query.has_contacts()) {
        for (const auto& [a, b] : touching_[node]) {
          v1::Contact& contact = *result.mutable_contacts()->add_contacts();
          contact.set_a(a);
          contact.set_b(b);
        }
      } else if (query.has_joint_states()) {
        *result.mutable_joint_states() = loads_[node];
      } else if (query.has_rays()) {
        HitWriter writer(*result.mutable_rays());
        for (int n = 0; n < query.rays().lengths_size(); ++n) writer.add({});
      }
      return part;
    };
  }

  v1::QueryResult ask(const v1::Query& query) {
    const HeardReply heard = cluster_->query(query);
    cluster_->work_all();
    EXPECT_TRUE(heard->ok()) << heard->message();
    return heard->answer.results_size() == 1 ? heard->answer.results(0) : v1::QueryResult();
  }

  void expect(const v1::Query& query, absl::StatusCode code, const std::string& words) {
    const auto heard = cluster_->query(query);
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  }

  // Of ball `child`, half a metre before it.
  static v1::Command joint(const std::string& name, const std::string& parent, const std::string& child,
                           v1::JointType type) {
    v1::Command command = hinge(name, parent, child);
    v1::JointProperties& properties = *command.mutable_add_joint()->mutable_joint()->mutable_properties();
    properties.set_type(type);
    *properties.mutable_in_child()->mutable_position() = xyz(-0.5, 0, 0);
    *properties.mutable_in_parent()->mutable_position() = parent.empty() ? xyz(48, 0, 0) : xyz(0.5, 0, 0);
    return command;
  }

  static v1::Query dynamics(const std::string& body) {
    v1::Query query;
    query.mutable_dynamics()->mutable_body()->set_name(body);
    query.mutable_dynamics()->set_mass_matrix(true);
    return query;
  }

  std::unique_ptr<TestCluster> cluster_ = loaded_cluster({}, balls());
  std::map<NodeId, std::vector<std::pair<std::uint64_t, std::uint64_t>>> touching_;
  std::map<NodeId, v1::JointColumns> loads_;
};

TEST_F(QueryKinds, ContactsOfAllServersAscendByPairs) {
  touching_ = {{kFirst, {{1, 5}, {2, 3}}}, {kSecond, {{1, 2}, {3, 4}, {3, 4}}}};
  v1::Query query;
  query.mutable_contacts()->add_bodies()->set_name("b3");
  query.mutable_contacts()->set_name_prefix("b");
  const v1::FoundContacts all = ask(query).contacts();
  std::vector<std::pair<std::uint64_t, std::uint64_t>> pairs;
  for (const v1::Contact& contact : all.contacts()) pairs.emplace_back(contact.a(), contact.b());
  using P = std::pair<std::uint64_t, std::uint64_t>;
  EXPECT_THAT(pairs, ElementsAre(P(1, 2), P(1, 5), P(2, 3), P(3, 4), P(3, 4)));
  EXPECT_FALSE(all.truncated());
  query.mutable_contacts()->set_limit(3);
  EXPECT_EQ(ask(query).contacts().contacts_size(), 3);
  EXPECT_TRUE(ask(query).contacts().truncated());
}

TEST_F(QueryKinds, ServersAreAskedForContactsOfBodiesByTheirIds) {
  v1::Query query;
  query.mutable_contacts()->add_bodies()->set_name("ground");
  query.mutable_contacts()->add_bodies()->set_id(2);
  cluster_->query(query);
  const v1::Queries asked = cluster_->take_grants(kFirst).at(0).questions(0).queries();
  ASSERT_EQ(asked.all(0).contacts().bodies_size(), 2);
  EXPECT_EQ(asked.all(0).contacts().bodies(0).id(), 2u);
  EXPECT_EQ(asked.all(0).contacts().bodies(1).id(), 5u);
  EXPECT_EQ(asked.all(0).contacts().limit(), kFoundBodiesDefault);
}

TEST_F(QueryKinds, ContactsAreOfBodiesThatExist) {
  v1::Query query;
  query.mutable_contacts();
  expect(query, kInvalid, "bodies or name_prefix must say");
  query.mutable_contacts()->add_bodies()->set_name("nobody");
  expect(query, absl::StatusCode::kNotFound, "nobody");
}

TEST_F(QueryKinds, DistancesGoOverBordersAndServers) {
  v1::Query query;
  query.mutable_distance()->mutable_a()->set_name("b2");
  query.mutable_distance()->mutable_b()->set_name("b4");
  query.mutable_distance()->set_reach(10);
  const v1::Distance found = ask(query).distance();
  EXPECT_FALSE(found.beyond());
  EXPECT_NEAR(found.distance(), 1.5, 1e-12);
  EXPECT_NEAR(found.normal().x(), -1, 1e-12);
  EXPECT_NEAR(from_proto(found.on_a()).local.x(), 49.75, 1e-12);
  EXPECT_EQ(from_proto(found.on_b()).sector, (SectorIndex{1, 0, 0}));
  EXPECT_NEAR(from_proto(found.on_b()).local.x(), -48.75, 1e-12);
  query.mutable_distance()->set_reach(1.4);
  EXPECT_TRUE(ask(query).distance().beyond());
  query.mutable_distance()->mutable_b()->set_name("ground");
  query.mutable_distance()->set_reach(2);
  EXPECT_NEAR(ask(query).distance().distance(), 1.75, 1e-12);
}

TEST_F(QueryKinds, DistancesAreOfTwoBodiesWithinABound) {
  v1::Query query;
  query.mutable_distance()->mutable_a()->set_name("b1");
  expect(query, kInvalid, "b must be set");
  query.mutable_distance()->mutable_b()->set_id(1);
  expect(query, kInvalid, "a and b must be two bodies");
  query.mutable_distance()->mutable_b()->set_id(2);
  for (const double reach : {-1.0, kNan, 401.0}) {
    query.mutable_distance()->set_reach(reach);
    expect(query, kInvalid, "m must be 0 m to 4 sectors");
  }
}

// A pendulum of two balls across the border: hinges about x, of which the first is the world's.
TEST_F(QueryKinds, DynamicsOfAChainThatHangsOnTheWorld) {
  EXPECT_TRUE(cluster_
                  ->apply({joint("first", "", "b1", v1::JOINT_PRISMATIC),
                           joint("second", "b1", "b2", v1::JOINT_REVOLUTE),
                           joint("third", "b2", "b3", v1::JOINT_FIXED)})
                  ->ok());
  const v1::Dynamics found = ask(dynamics("b3")).dynamics();
  EXPECT_EQ(found.base(), 0u);
  EXPECT_THAT(found.joints(), ElementsAre(1, 2, 3));
  EXPECT_THAT(found.freedoms(), ElementsAre(1, 1, 0));
  ASSERT_EQ(found.mass_matrix_size(), 4);
  EXPECT_NEAR(found.mass_matrix(0), 3 * kMass, 1e-12) << "all slide along x";
  EXPECT_NEAR(found.mass_matrix(1), 0, 1e-12);
  EXPECT_NEAR(found.mass_matrix(3), 2 * kMoment, 1e-12) << "two turn about it";
  EXPECT_THAT(found.bias(), ElementsAre(::testing::DoubleNear(0, 1e-12), ::testing::DoubleNear(0, 1e-12)));
}

TEST_F(QueryKinds, DynamicsOfWhatFloats) {
  EXPECT_TRUE(cluster_->apply(joint("ball", "b4", "b3", v1::JOINT_BALL))->ok());
  v1::Query query;
  query.mutable_dynamics()->mutable_joint()->set_name("ball");
  v1::DynamicsQuery::Point& point = *query.mutable_dynamics()->add_points();
  point.mutable_body()->set_name("b4");
  *point.mutable_local() = xyz(0, 0, 1);
  for (int n = 0; n < 9; ++n) query.mutable_dynamics()->add_accelerations(n == 2 ? 1 : 0);
  const v1::Dynamics found = ask(query).dynamics();
  EXPECT_EQ(found.base(), 3u) << "the lowest id";
  EXPECT_THAT(found.freedoms(), ElementsAre(3));
  ASSERT_EQ(found.velocities_size(), 9);
  EXPECT_NEAR(found.bias(2), 2 * kMass * 9.81, 0.02);
  EXPECT_NEAR(found.efforts(2) - found.bias(2), 2 * kMass, 1e-12);
  ASSERT_EQ(found.jacobians_size(), 6 * 9);
  EXPECT_NEAR(found.jacobians(0), 1, 1e-12) << "with the base, along x";
  EXPECT_NEAR(found.jacobians(4), 1, 1e-12) << "a turn of the base about y moves what is above it along x";
  EXPECT_EQ(found.mass_matrix_size(), 0);
}

TEST_F(QueryKinds, DynamicsAreOfTrees) {
  EXPECT_TRUE(cluster_
                  ->apply({joint("first", "b1", "b2", v1::JOINT_REVOLUTE),
                           joint("second", "b2", "b3", v1::JOINT_REVOLUTE)})
                  ->ok());
  expect(dynamics("ground"), kInvalid, "body must be dynamic");
  v1::Query query;
  query.mutable_dynamics();
  expect(query, kInvalid, "body or joint must say");
  query = dynamics("b1");
  query.mutable_dynamics()->add_accelerations(1);
  expect(query, kInvalid, "must be as many as the 8 degrees of freedom");
  query = dynamics("b1");
  query.mutable_dynamics()->add_points()->mutable_body()->set_name("b4");
  expect(query, kInvalid, "points: body must be of the assembly");
  EXPECT_TRUE(cluster_->apply(joint("closing", "b1", "b3", v1::JOINT_BALL))->ok());
  expect(dynamics("b2"), kInvalid, "closes a loop");
}

TEST_F(QueryKinds, LoadsComeFromWhoHostsTheChild) {
  EXPECT_TRUE(cluster_
                  ->apply({joint("first", "b1", "b2", v1::JOINT_REVOLUTE),
                           joint("second", "b2", "b3", v1::JOINT_BALL),
                           joint("third", "b3", "b4", v1::JOINT_PRISMATIC)})
                  ->ok());
  v1::JointColumns& of_first = loads_[kFirst];
  of_first.add_ids(1);
  of_first.add_axes(1);
  of_first.add_efforts(7);
  for (int n = 1; n <= 6; ++n) of_first.add_reactions(n);
  v1::JointColumns& of_second = loads_[kSecond];
  of_second.add_ids(2);
  of_second.add_axes(0);
  for (int n = 11; n <= 16; ++n) of_second.add_reactions(n);
  v1::Query query;
  query.mutable_joint_states()->set_efforts(true);
  query.mutable_joint_states()->set_reactions(true);
  const v1::JointColumns columns = ask(query).joint_states();
  EXPECT_THAT(columns.efforts(), ElementsAre(7, 0)) << "of the third, nobody knows";
  EXPECT_THAT(columns.reactions(), ElementsAre(1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16, 0, 0, 0, 0, 0, 0));
  of_second.add_efforts(3);
  const auto heard = cluster_->query(query);
  cluster_->work_all();
  EXPECT_EQ(heard->code(), absl::StatusCode::kDataLoss) << heard->message();
}

// One of each kind, in a list after one that is right: the error names the element, and nobody is asked.
class WrongQueries : public QueryKinds {
 protected:
  WrongQueries() {
    EXPECT_TRUE(cluster_->apply(joint("hinge", "b1", "b2", v1::JOINT_REVOLUTE))->ok());
    v1::Query ray;
    *ray.mutable_ray()->mutable_origin() = to_proto(WorldPosition{});
    *ray.mutable_ray()->mutable_direction() = xyz(0, 0, -1);
    ray.mutable_ray()->set_length(10);
    v1::Query rays;
    RayWriter(*rays.mutable_rays()).add({{}, {0, 0, -1}, 10, {}});
    v1::Query sweep;
    *sweep.mutable_sweep()->mutable_pose() = to_proto(WorldPose{});
    sweep.mutable_sweep()->mutable_probe()->mutable_sphere()->set_radius(1);
    *sweep.mutable_sweep()->mutable_direction() = xyz(0, 0, -1);
    sweep.mutable_sweep()->set_length(10);
    v1::Query near;
    *near.mutable_near()->mutable_pose() = to_proto(WorldPose{});
    near.mutable_near()->mutable_probe()->mutable_sphere()->set_radius(1);
    v1::Query contacts;
    contacts.mutable_contacts()->add_bodies()->set_name("b1");
    v1::Query distance;
    distance.mutable_distance()->mutable_a()->set_name("b1");
    distance.mutable_distance()->mutable_b()->set_id(2);
    v1::Query by_joint;
    by_joint.mutable_dynamics()->mutable_joint()->set_name("hinge");
    v1::Query dynamics = this->dynamics("b1");
    for (int n = 0; n < 7; ++n) dynamics.mutable_dynamics()->add_accelerations(1);
    v1::DynamicsQuery::Point& point = *dynamics.mutable_dynamics()->add_points();
    point.mutable_body()->set_name("b2");
    *point.mutable_local() = xyz(0, 0, 1);
    all_ = {ray, rays, sweep, near, contacts, distance, by_joint, dynamics, hash_query()};
    all_.emplace_back().mutable_states();
    all_.emplace_back().mutable_joint_states();
    all_.emplace_back().mutable_find_bodies();
    all_.emplace_back().mutable_find_joints();
    all_.emplace_back().mutable_find_frames();
    all_.emplace_back().mutable_programs();
  }

  void expect_refused(const v1::Request& list, absl::StatusCode code) {
    const HeardReply heard = cluster_->send(list);
    EXPECT_EQ(heard->code(), code) << heard->message() << "\n" << list.queries(1).DebugString();
    const int kind = list.queries(1).kind_case();
    EXPECT_THAT(heard->message(),
                ::testing::StartsWith("queries[1] (" +
                                      v1::Query::descriptor()->FindFieldByNumber(kind)->name() + "): "));
    EXPECT_TRUE(cluster_->inbox[kFirst].empty());
  }

  std::vector<v1::Query> all_;
};

TEST_F(WrongQueries, AreOfAllKindsHere) {
  std::set<v1::Query::KindCase> kinds;
  for (const v1::Query& query : all_) {
    const HeardReply heard = cluster_->query(query);
    cluster_->work_all();
    EXPECT_TRUE(heard->ok()) << heard->message() << query.DebugString();
    kinds.insert(query.kind_case());
  }
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(v1::Query::descriptor()->field_count()));
}

TEST_F(WrongQueries, NumbersThatAreNone) {
  for (const v1::Query& query : all_) {
    v1::Request list = request_of({}, 0, {hash_query(), query});
    with_each_number_wrong(*list.mutable_queries(1), [&](const std::string& field) {
      SCOPED_TRACE(field);
      expect_refused(list, kInvalid);
    });
  }
}

TEST_F(WrongQueries, BodiesAndJointsThatThereAreNot) {
  for (const v1::Query& query : all_) {
    v1::Request list = request_of({}, 0, {hash_query(), query});
    with_each_reference_wrong(*list.mutable_queries(1), [&](const std::string& field) {
      SCOPED_TRACE(field);
      expect_refused(list, absl::StatusCode::kNotFound);
    });
  }
}

TEST_F(QueryKinds, WithoutLoadsServersAreNotAskedForThem) {
  v1::Query query;
  query.mutable_joint_states();
  cluster_->query(query);
  EXPECT_EQ(cluster_->take_grants(kFirst).at(0).questions(0).queries().all_size(), 1);
}

}  // namespace
}  // namespace tessera
