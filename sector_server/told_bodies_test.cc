// What several servers tell of a world, tick by tick, is what the world is: whatever is left out on the way,
// whoever hosts which sector, and whatever a client asks for.
#include "sector_server/told_bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <limits>
#include <map>
#include <ostream>
#include <random>

#include "client_sdk/src/body_frames.h"
#include "client_sdk/src/stream_traits.h"
#include "lpss/model/world_records.h"
#include "lpss/partition/packing.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "proto/convert.h"

namespace tessera {
namespace {

constexpr int kBodies = 60;
constexpr int kTicks = 300;

struct StreamCase {
  const char* name;
  std::uint32_t servers;
  v1::WatchBodiesRequest request;
  bool drops = false;                                                // some news find no room
  std::size_t bodies_max = std::numeric_limits<std::size_t>::max();  // in a batch

  bool is_limited() const { return bodies_max < kBodies; }

  friend void PrintTo(const StreamCase& given, std::ostream* out) { *out << given.name; }
};

std::vector<std::uint64_t> ids_of(const std::map<BodyId, WorldPosition>& bodies) {
  std::vector<std::uint64_t> ids;
  for (const auto& [id, position] : bodies) ids.push_back(id.value);
  return ids;
}

v1::WatchBodiesRequest in_region(double precision = 0) {
  v1::WatchBodiesRequest request;
  request.set_in_columns(true);
  request.set_precision(precision);
  *request.mutable_region()->mutable_half_size() = to_proto(Eigen::Vector3d(3, 3, 1.5));
  return request;
}
v1::WatchBodiesRequest of_all(double precision = 0) {
  v1::WatchBodiesRequest request;
  request.set_in_columns(true);
  request.set_precision(precision);
  return request;
}
v1::WatchBodiesRequest of_ids(int count, bool awake = false) {
  v1::WatchBodiesRequest request = of_all();
  for (int n = 0; n < count; ++n) request.add_ids(1 + 2 * n);
  request.add_ids(kBodies + 1);  // static
  request.set_only_awake(awake);
  return request;
}

class ToldWorld : public testing::TestWithParam<StreamCase> {
 protected:
  void SetUp() override {
    WorldDescription world = pile_world(sectors_of(4), kBodies);
    world.settings.sleep_after = 0.1;
    if (GetParam().servers > 1) world.settings.shuffle = 7;
    cluster_ = cluster_of(world, GetParam().servers);
    for (Rank rank = 0; rank < GetParam().servers; ++rank) {
      cluster_->partition(rank).pack_after = 0;
      told_.emplace_back(GetParam().request);
      batches_.emplace_back(GetParam().request);
      readers_.emplace_back(GetParam().request);
    }
    changes_.resize(GetParam().servers);
    size_ = world.settings.sector_size;
  }

  std::vector<Command> some_commands() {
    std::vector<Command> commands;
    if (random_() % 8 != 0) return commands;
    const BodyId id{random_() % kBodies + 1};
    const absl::StatusOr<BodyRecord> record = cluster_->body(id);
    if (!record.ok()) return commands;
    switch (random_() % 4) {
      case 0:
        commands.push_back(RemoveBody{id, {}});
        break;
      case 1: {
        Teleport jump{id, record->home, record->state};
        jump.state.position[0] = -jump.state.position[0];
        jump.state.activity = Activity::kAwake;
        commands.push_back(jump);
        break;
      }
      default:
        commands.push_back(ApplyImpulse{id, {0, 0, 3 * record->properties.mass}, {}});
    }
    return commands;
  }

  // What matches, from the partitions themselves.
  std::map<BodyId, WorldPosition> expected() {
    const v1::WatchBodiesRequest& request = GetParam().request;
    std::map<BodyId, WorldPosition> all;
    const auto consider = [&](const BodyRecord& body) {
      const WorldPosition at{body.home, Eigen::Vector3d(body.state.position.data())};
      if (request.only_awake() && body.state.activity == Activity::kAsleep) return;
      if (request.has_region()) {
        const Eigen::Vector3d away = relative_to(at, {}, size_).cwiseAbs();
        if ((away.array() > from_proto(request.region().half_size()).array()).any()) return;
      }
      const auto& ids = request.ids();
      if (!ids.empty() && std::find(ids.begin(), ids.end(), body.id.value) == ids.end()) return;
      all.emplace(body.id, body_pose(body.home, body.state, centre_frame(body.properties), size_).position);
    };
    for (Rank rank = 0; rank < GetParam().servers; ++rank) {
      const Partition& partition = cluster_->partition(rank);
      for_each_body(partition, consider);
      if (request.ids().empty() || request.only_awake()) continue;
      if (rank == 0) partition.statics.for_each(consider);
    }
    return all;
  }

  // The batch of a server; nothing where it does not find room.
  std::optional<BodyNews> batch(Rank rank, Tick tick) {
    const Partition& partition = cluster_->partition(rank);
    BodySnapshot snapshot = told_[rank].news(partition, changes_[rank], {}, GetParam().bodies_max);
    EXPECT_LE(snapshot.bodies.size(), GetParam().bodies_max);
    if (GetParam().drops && random_() % 3 == 0) return std::nullopt;
    told_[rank].told(snapshot);
    deferred_ += snapshot.deferred;
    snapshot.tick = tick;
    v1::BodyBatch message;
    batches_[rank].write(snapshot, NodeId{rank + 1}, message);
    absl::StatusOr<BodyNews> news = readers_[rank].read(message);
    EXPECT_TRUE(news.ok()) << news.status();
    return *std::move(news);
  }

  std::mt19937 random_{1};
  std::unique_ptr<PartitionCluster> cluster_;
  std::vector<BodyChanges> changes_;
  std::vector<ToldBodies> told_;
  std::deque<BodyBatches> batches_;
  std::vector<BodyReader> readers_;
  double size_ = 0;
  std::uint64_t deferred_ = 0;  // of the last tick
};

TEST_P(ToldWorld, IsTheWorld) {
  const std::uint64_t every = std::max<std::uint64_t>(GetParam().request.every_ticks(), 1);
  StreamMerger<BodyNews> merger;
  KnownBodies known(true);
  int compared = 0;
  bool is_known = false;
  // Where bodies wait, the world comes to rest, and all is known in the end.
  for (Tick tick = 0; tick < kTicks || (GetParam().is_limited() && !is_known); ++tick) {
    ASSERT_LT(tick, 10 * kTicks);
    bool is_whole = tick % every == 0;
    deferred_ = 0;
    for (Rank rank = 0; rank < GetParam().servers; ++rank) {
      changes_[rank].look(cluster_->partition(rank));
      if (tick % every != 0) continue;
      if (std::optional<BodyNews> news = batch(rank, tick)) {
        merger.push({.load = 1, .epoch = 1, .servers = GetParam().servers, .node = rank + 1, .since = 0},
                    *std::move(news));
      } else {
        is_whole = false;
      }
      changes_[rank].drop_until(told_[rank].until().value_or(0));
    }
    if (is_whole) {
      absl::StatusOr<BodyNews> news = merger.next(absl::ZeroDuration());
      ASSERT_TRUE(news.ok()) << news.status();
      ASSERT_EQ(news->tick, tick);
      std::map<BodyId, WorldPosition> frame;
      for (const BodySample& body : known.take(*news).bodies) frame.emplace(body.id, body.pose.position);
      is_known = deferred_ == 0;
      const std::map<BodyId, WorldPosition> world = is_known ? expected() : std::map<BodyId, WorldPosition>();
      if (!is_known) frame.clear();
      ASSERT_EQ(ids_of(frame), ids_of(world)) << "tick " << tick;
      for (const auto& [id, position] : world) {
        const WorldPosition& told = frame.at(id);
        ASSERT_LE((relative_to(told, position.sector, size_) - position.local).norm(),
                  GetParam().request.precision() * 1.000001)
            << "tick " << tick;
      }
      ++compared;
    }
    cluster_->step(tick < kTicks ? some_commands() : std::vector<Command>());
  }
  EXPECT_GT(compared, 10);
}

INSTANTIATE_TEST_SUITE_P(
    Streams, ToldWorld,
    testing::Values(StreamCase{"all", 1, of_all()}, StreamCase{"all_of_three", 3, of_all()},
                    StreamCase{"region", 3, in_region()}, StreamCase{"ids", 3, of_ids(20)},
                    StreamCase{"awake", 3, of_ids(20, true)}, StreamCase{"few", 1, of_ids(2)},
                    StreamCase{"seldom", 3,
                               [] {
                                 v1::WatchBodiesRequest request = in_region();
                                 request.set_every_ticks(7);
                                 return request;
                               }()},
                    StreamCase{"slow", 3, of_all(), true}, StreamCase{"packed", 3, of_all(1e-3)},
                    StreamCase{"slow_packed", 3, in_region(1e-3), true},
                    StreamCase{"slow_region", 2, in_region(), true},
                    StreamCase{"limited", 1, of_all(), false, 7},
                    StreamCase{"limited_of_three", 3, of_all(), false, 2},
                    StreamCase{"limited_region", 3, in_region(), false, 1},
                    StreamCase{"limited_ids", 3, of_ids(20), false, 3},
                    StreamCase{"limited_awake", 2, of_ids(20, true), false, 2},
                    StreamCase{"limited_packed", 3, of_all(1e-3), false, 2},
                    StreamCase{"limited_slow_packed", 2, of_all(1e-3), true, 3}),
    [](const auto& given) { return std::string(given.param.name); });

TEST(ToldBodies, SayNothingOfSleepers) {
  const std::unique_ptr<PartitionCluster> cluster = cluster_of(pile_world({}, kBodies), 1);
  const Partition& partition = cluster->partition(0);
  BodyChanges changes;
  ToldBodies told({});
  std::size_t last = 0;
  for (int tick = 0; tick < 1200; ++tick) {
    changes.look(cluster->partition(0));
    const BodySnapshot news = told.news(partition, changes, {});
    told.told(news);
    EXPECT_EQ(news.whole, tick == 0);
    last = news.bodies.size();
    cluster->step();
  }
  std::size_t awake = 0;
  for_each_body(partition,
                [&](const BodyRecord& body) { awake += body.state.activity == Activity::kAsleep ? 0 : 1; });
  EXPECT_EQ(last, awake);
  EXPECT_LT(awake, kBodies / 4u);
}

// All bodies are awake, in five layers, and a batch has a tenth of them.
TEST(ToldBodies, OfMoreThanTheBudgetTheNearestAreToldMostAndAllAreTold) {
  const WorldSettings settings;
  const std::unique_ptr<PartitionCluster> cluster = cluster_of(pile_world(settings, kBodies), 1);
  v1::WatchBodiesRequest request;
  const double corner = settings.sector_size / 2;
  *request.mutable_region()->mutable_centre() =
      to_proto(WorldPosition{{}, Eigen::Vector3d::Constant(corner)});
  *request.mutable_region()->mutable_half_size() = to_proto(Eigen::Vector3d(6, 6, 6));
  BodyChanges changes;
  ToldBodies told(request);
  std::map<std::uint64_t, int> times;
  std::array<int, 5> by_layer{};
  constexpr std::uint64_t kFirst = 2;  // the floor is the first one of the world
  for (int batch = 0; batch < 300; ++batch) {
    changes.look(cluster->partition(0));
    const BodySnapshot news = told.news(cluster->partition(0), changes, {}, kBodies / 10);
    told.told(news);
    ASSERT_EQ(news.bodies.size(), kBodies / 10u);
    ASSERT_EQ(news.deferred, kBodies - kBodies / 10u);
    for (const BodySnapshot::Body& body : news.bodies) {
      ++times[body.id.value];
      ++by_layer.at((body.id.value - kFirst) / (kBodies / by_layer.size()));
    }
    changes.drop_until(told.until().value_or(0));
  }
  EXPECT_EQ(times.size(), static_cast<std::size_t>(kBodies));
  EXPECT_TRUE(std::is_sorted(by_layer.rbegin(), by_layer.rend()));
  EXPECT_GT(by_layer.front(), 2 * by_layer.back());
}

}  // namespace
}  // namespace tessera
