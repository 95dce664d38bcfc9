// Rays in columns: what is refused, what servers are asked, and what comes of their answers.
#include <map>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/model/limits.h"
#include "proto/ray_columns.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RaysInColumns : public ::testing::Test {
 protected:
  // `count` rays to the east, from x = 0, 1 and so on of sector (4, 0, 0).
  static v1::Query rays(int count) {
    v1::Query query;
    RayWriter writer(*query.mutable_rays());
    for (int n = 0; n < count; ++n)
      writer.add({{{4, 0, 0}, {static_cast<double>(n), 0, 0}}, {1e-200, 0, 0}, 1000, {}});
    return query;
  }

  // Each server says that it hits these bodies, ray by ray, at these distances; 0: none.
  using Told = std::map<NodeId, std::vector<std::pair<std::uint64_t, double>>>;
  void tell(const Told& told) {
    cluster_->knows = [told](NodeId node, const v1::Query&) {
      v1::PartialResult part;
      v1::HitColumns& columns = *part.mutable_result()->mutable_rays();
      for (const auto& [body, distance] : told.at(node)) {
        columns.add_bodies(body);
        columns.add_distances(distance);
        for (const double x : {-1.0, 0.0, 0.0}) columns.add_normals(x);
      }
      return part;
    };
  }

  void expect_refusal(const v1::Query& query, absl::StatusCode code, const std::string& words) {
    const HeardReply heard = cluster_->query(query);
    EXPECT_EQ(heard->code(), code);
    EXPECT_THAT(heard->message(), HasSubstr(words));
    EXPECT_TRUE(cluster_->inbox[kFirst].empty());
  }

  const std::unique_ptr<TestCluster> cluster_ = loaded_cluster();
};

TEST_F(RaysInColumns, TheNearestHitOfEachWinsAndTheSmallestIdAmongEquals) {
  tell({{kFirst, {{4, 70}, {3, 20}, {0, 0}, {0, 0}}}, {kSecond, {{2, 60}, {2, 20}, {4, 5}, {0, 0}}}});
  const HeardReply heard = cluster_->query(rays(4));
  cluster_->work_all();
  ASSERT_TRUE(heard->ok()) << heard->message();
  std::vector<HitRow> hits;
  ASSERT_TRUE(append_rows(heard->answer.results(0).rays(), hits).ok());
  ASSERT_EQ(hits.size(), 4u);
  std::vector<std::uint64_t> bodies;
  for (const HitRow& hit : hits) bodies.push_back(hit.body.value);
  EXPECT_THAT(bodies, ElementsAre(2, 2, 4, 0));
  EXPECT_EQ(hits[0].distance, 60);
  EXPECT_EQ(hits[0].position, (WorldPosition{{5, 0, 0}, {-40, 0, 0}}));
  EXPECT_EQ(hits[0].normal.x(), -1);
  EXPECT_EQ(hits[1].position, (WorldPosition{{4, 0, 0}, {21, 0, 0}}));
}

// Places are canonical, directions have unit length, and there is an element of each array for each ray.
TEST_F(RaysInColumns, ServersAreAskedWhatTheyKnow) {
  v1::Query query;
  v1::RaysQuery& given = *query.mutable_rays();
  given.mutable_origins()->Add(130);
  given.mutable_origins()->Add(0);
  given.mutable_origins()->Add(0);
  for (const double x : {0, 0, -2, 0, 3, 0}) given.add_directions(x);
  given.add_lengths(7);
  given.add_except()->set_name("egg");
  given.add_except()->set_id(2);
  given.add_except_by_ray(0);
  given.add_except_by_ray(3);
  cluster_->query(query);
  const v1::RaysQuery asked = cluster_->take_grants(kFirst).at(0).questions(0).queries().all(0).rays();
  EXPECT_EQ(asked.sector_size(), 2);
  EXPECT_EQ(asked.lengths_size(), 2);
  const absl::StatusOr<RayReader> read = RayReader::of(asked);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ((*read)[1].origin, (WorldPosition{{1, 0, 0}, {30, 0, 0}}));
  EXPECT_EQ((*read)[0].direction, Eigen::Vector3d(0, 0, -1));
  EXPECT_EQ((*read)[1].direction, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ((*read)[1].except, BodyId{3});
  EXPECT_EQ(asked.mask(), 0xffffffffu);
  ASSERT_EQ(asked.except_size(), 2);
  EXPECT_EQ(asked.except(0).id(), 2u);
  EXPECT_EQ(asked.except(1).id(), 4u);
}

TEST_F(RaysInColumns, NoRaysHitNothing) {
  tell({{kFirst, {}}, {kSecond, {}}});
  const HeardReply heard = cluster_->query(rays(0));
  cluster_->work_all();
  ASSERT_TRUE(heard->ok()) << heard->message();
  EXPECT_TRUE(heard->answer.results(0).has_rays());
  EXPECT_EQ(heard->answer.results(0).rays().bodies_size(), 0);
}

TEST_F(RaysInColumns, AnAnswerOfAnotherLengthIsDataLoss) {
  tell({{kFirst, {{4, 70}}}, {kSecond, {{2, 60}, {2, 20}}}});
  const HeardReply heard = cluster_->query(rays(2));
  cluster_->work_all();
  EXPECT_EQ(heard->code(), absl::StatusCode::kDataLoss) << heard->message();
}

TEST_F(RaysInColumns, BoundsAreOfElementsOfColumns) {
  v1::Query query = rays(3);
  query.mutable_rays()->set_lengths(2, -1);
  expect_refusal(query, kInvalid, "lengths[2] = -1 m must be above 0 m and at most");
  query = rays(3);
  query.mutable_rays()->set_directions(3, 0);
  expect_refusal(query, kInvalid, "directions[1] = (0, 0, 0) must not be zero");
  query = rays(3);
  query.mutable_rays()->set_directions(4, kNan);
  expect_refusal(query, kInvalid, "directions[1] y = nan must be finite");
  query = rays(3);
  query.mutable_rays()->set_origins(7, kNan);
  expect_refusal(query, kInvalid, "origins[2]");
  query = rays(3);
  query.mutable_rays()->mutable_sectors(0)->set_i(std::numeric_limits<std::int64_t>::max());
  query.mutable_rays()->set_directions(0, -1);
  expect_refusal(query, absl::StatusCode::kOutOfRange, "the end of ray 1");
  query = rays(3);
  query.mutable_rays()->add_lengths(1);
  expect_refusal(query, kInvalid, "elements must be one for each of 4 rays, or one for all");
}

// However they are divided among queries.
TEST_F(RaysInColumns, CountAsSingleOnesDo) {
  WorldDescription world = small_world();
  world.bodies.resize(2);
  world.settings.sector_size = 10;
  const auto cluster = loaded_cluster({}, world);
  v1::Query query;
  for (const double x : {0, 0, 0}) query.mutable_rays()->add_origins(x);
  for (const double x : {1, 0, 0}) query.mutable_rays()->add_directions(x);
  query.mutable_rays()->mutable_lengths()->Resize(static_cast<int>(kRaysPerRequestMax), 1);
  EXPECT_FALSE(cluster->query(query)->status) << "it is asked";
  EXPECT_THAT(cluster->query({query, rays(1)})->message(),
              HasSubstr("queries: 100001 rays in columns must be at most 100000"));
  const auto longest = static_cast<int>(static_cast<double>(kWaySectorsPerRequestMax) / kRaySectorsMax);
  query.mutable_rays()->mutable_lengths()->Clear();
  query.mutable_rays()->mutable_lengths()->Resize(longest, 10 * kRaySectorsMax);
  EXPECT_FALSE(cluster->query(query)->status) << "it is asked";
  query.mutable_rays()->add_lengths(10 * kRaySectorsMax);
  EXPECT_THAT(cluster->query(query)->message(),
              HasSubstr("327680 sectors in all, and may pass through 262144"));
  query = rays(1);
  query.mutable_rays()->mutable_except_by_ray()->Resize(static_cast<int>(kIdsPerRequestMax) + 1, 0);
  EXPECT_THAT(cluster->query(query)->message(), HasSubstr("262145 ids must be at most 262144"));
}

}  // namespace
}  // namespace tessera
