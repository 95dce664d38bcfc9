// Streams over several servers: bodies cross borders, contacts occur once, the end of a stream is reported.
#include <signal.h>

#include <future>
#include <map>
#include <set>
#include <tuple>

#include "lpss/simulation/simulation.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr double kSectorSize = 8;

// A ball that rolls from the far west to the far east, and crates at rest on both sides, so that the border
// between the servers is in between.
WorldDescription crossing_world() {
  WorldDescription world = flat_world(kSectorSize);
  BodyDescription& ball = add(world, solid("ball", sphere(0.5), 10, {{0, 0, 0}, {-18, 0, 0.5}}));
  ball.linear_velocity = {8, 0, 0};
  ball.angular_velocity = {0, 16, 0};
  for (const double x : {-20.0, -22.0, 20.0, 22.0}) {
    add(world, solid(absl::StrCat("crate", x), box(1, 1, 1), 10, {{0, 0, 0}, {x, 6, 0.5}}));
  }
  return world;
}

// The number of bodies on each server.
std::map<std::uint64_t, std::uint64_t> bodies_by_server(Client& client) {
  std::map<std::uint64_t, std::uint64_t> bodies;
  const ClusterStatus status = client.status().value();
  for (const ServerStatus& server : status.servers) bodies[server.node] = server.bodies;
  return bodies;
}

TEST(BodyStreamTest, BodyCrossesFromServerToServerWithoutGapOrJump) {
  constexpr std::uint64_t kTicks = 270;
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(crossing_world()).status(), IsOk());
  ASSERT_THAT(client.step(1, kPatience).status(), IsOk());
  const BodyId ball = client.find("ball").value().id;
  const std::unique_ptr<BodyStream> stream = client.watch_bodies({.ids = {ball}}, kPatience).value();
  const auto before = bodies_by_server(client);
  std::future<absl::Status> stepped =
      std::async(std::launch::async, [&] { return client.step(kTicks, kPatience).status(); });

  WorldPosition last;
  std::set<std::int64_t> sectors;
  std::set<std::uint64_t> servers;
  for (Tick tick = 1; tick <= 1 + kTicks; ++tick) {
    const absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    ASSERT_EQ(frame->tick, tick);
    ASSERT_EQ(frame->bodies.size(), 1u);
    ASSERT_EQ(frame->bodies[0].id, ball);
    servers.insert(frame->bodies[0].server);
    const WorldPosition& position = frame->bodies[0].pose.position;
    if (tick > 1) {
      const double way = (relative_to(position, last.sector, kSectorSize) - last.local).norm();
      EXPECT_LT(way, 8.5 / 60);
      EXPECT_GT(way, 4.0 / 60);
    }
    last = position;
    sectors.insert(position.sector.i);
  }
  EXPECT_GE(sectors.size(), 4u);
  EXPECT_EQ(servers.size(), 2u);
  EXPECT_THAT(stepped.get(), IsOk());
  EXPECT_EQ(stream->skipped(), 0u);
  const auto after = bodies_by_server(client);
  EXPECT_EQ(before.size(), 2u);
  EXPECT_NE(before, after);  // it moved from one server to the other
}

TEST(BodyStreamTest, EveryBodyIsInEveryFrameOnceAndEveryTicksHolds) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("busy.sdf")).status(), IsOk());
  const auto movable = [](const FoundBody& body) { return body.properties.motion != Motion::kStatic; };
  const std::vector<FoundBody> all = client.find_bodies("").value().bodies;
  const auto count = static_cast<std::size_t>(std::count_if(all.begin(), all.end(), movable));
  BodyFilter filter;
  filter.every_ticks = 5;
  filter.complete = true;
  const std::unique_ptr<BodyStream> stream = client.watch_bodies(filter, kPatience).value();
  ASSERT_THAT(client.step(100, kPatience).status(), IsOk());
  for (std::uint64_t tick = 0; tick <= 100; tick += 5) {
    const absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    EXPECT_EQ(frame->tick, tick);
    EXPECT_EQ(frame->bodies.size(), count);
    std::set<BodyId> ids;
    for (const BodySample& body : frame->bodies) ids.insert(body.id);
    EXPECT_EQ(ids.size(), count);
  }
}

// What frames up to a tick have told of.
struct Told {
  std::multiset<BodyId> bodies;
  std::multiset<BodyId> gone;
};

Told told_until(BodyStream& stream, Tick last) {
  Told told;
  for (;;) {
    const absl::StatusOr<BodyFrame> frame = stream.next(kPatience);
    EXPECT_THAT(frame.status(), IsOk());
    if (!frame.ok()) return told;
    for (const BodySample& body : frame->bodies) told.bodies.insert(body.id);
    told.gone.insert(frame->gone.begin(), frame->gone.end());
    if (frame->tick == last) return told;
  }
}

TEST(BodyStreamTest, BodiesAtRestAreToldOnceUntilTheyAreMovedOrRemoved) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  WorldDescription world = flat_world(kSectorSize);
  for (const double x : {-20.0, -12.0, 12.0, 20.0})
    add(world, solid(absl::StrCat("crate", x), box(1, 1, 1), 10, {{0, 0, 0}, {x, 6, 0.5}}));
  ASSERT_THAT(client.load(world).status(), IsOk());
  ASSERT_THAT(client.step(200, kPatience).status(), IsOk());
  const auto id_of = [&](const char* name) { return client.find(name).value().id; };
  const BodyId west = id_of("crate-20");
  const BodyId east = id_of("crate20");
  const std::unique_ptr<BodyStream> stream = client.watch_bodies({}, kPatience).value();
  EXPECT_EQ(stream->next(kPatience).value().bodies.size(), 4u);
  EXPECT_TRUE(told_until(*stream, client.step(20, kPatience).value()).bodies.empty());

  // From one server to the other, and out of the world.
  ASSERT_THAT(client.teleport(west, {{{0, 0, 0}, {18, 2, 0.5}}}).status(), IsOk());
  ASSERT_THAT(client.remove(id_of("crate12")).status(), IsOk());
  const Told moved = told_until(*stream, client.step(200, kPatience).value());
  EXPECT_GT(moved.bodies.count(west), 0u);
  EXPECT_EQ(moved.bodies.count(west), moved.bodies.size()) << "nothing else";
  EXPECT_EQ(moved.gone.size(), 1u);
  EXPECT_TRUE(told_until(*stream, client.step(20, kPatience).value()).bodies.empty());

  // Out of the region that a client watches.
  BodyFilter filter;
  filter.region = {{.centre = {{0, 0, 0}, {20, 4, 0}}, .half_size = {4, 4, 4}}};
  const std::unique_ptr<BodyStream> here = client.watch_bodies(filter, kPatience).value();
  EXPECT_EQ(here->next(kPatience).value().bodies.size(), 2u);
  ASSERT_THAT(client.teleport(east, {{{0, 0, 0}, {30, 2, 0.5}}}).status(), IsOk());
  const Told left = told_until(*here, client.step(1, kPatience).value());
  EXPECT_EQ(left.gone, std::multiset<BodyId>{east});
  EXPECT_TRUE(left.bodies.empty());
}

// Clones and islands after some ticks, without the servers that reported them.
using SeamsSeen = std::pair<std::vector<std::pair<BodyId, SectorIndex>>,
                            std::vector<std::pair<BodyId, std::vector<BodyId>>>>;

SeamsSeen seams_after(Client& client, Tick ticks) {
  const std::unique_ptr<SeamStream> stream = client.watch_seams({}, kPatience).value();
  EXPECT_THAT(client.step(ticks, kPatience).status(), IsOk());
  SeamsSeen seen;
  for (Tick tick = 0; tick <= ticks; ++tick) {
    const absl::StatusOr<SeamFrame> frame = stream->next(kPatience);
    EXPECT_THAT(frame.status(), IsOk());
    if (!frame.ok()) return seen;
    EXPECT_EQ(frame->tick, tick);
    if (tick < ticks) continue;
    for (const CloneSample& clone : frame->clones) seen.first.emplace_back(clone.body, clone.sector);
    for (const IslandSample& island : frame->islands) seen.second.emplace_back(island.id, island.bodies);
  }
  return seen;
}

TEST(SeamStreamTest, TwoServersTellOfTheSameCopiesAndIslandsAsOne) {
  constexpr Tick kTicks = 20;
  SeamsSeen seen[2];
  std::vector<BodyId> tower;
  for (const int servers : {1, 2}) {
    const Cluster cluster = start_cluster(servers);
    ASSERT_TRUE(cluster.client);
    ASSERT_THAT(cluster.client->load(read_world("seam.sdf")).status(), IsOk());
    seen[servers - 1] = seams_after(*cluster.client, kTicks);
    tower.clear();
    const FoundBodies boxes = cluster.client->find_bodies("tower_2::").value();
    for (const FoundBody& box : boxes.bodies) tower.push_back(box.id);
  }
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_FALSE(seen[1].first.empty());
  const auto is_tower = [&](const auto& island) { return island.second == tower; };
  EXPECT_EQ(std::count_if(seen[1].second.begin(), seen[1].second.end(), is_tower), 1);
}

using Event = std::tuple<Tick, bool, int, std::uint64_t, std::uint64_t>;

class ContactStreamTest : public ::testing::TestWithParam<const char*> {};

TEST_P(ContactStreamTest, EachEventIsToldOnceAsInOneProcess) {
  constexpr std::uint64_t kTicks = 120;
  const WorldDescription world = read_world(GetParam());
  std::vector<Event> expected;
  const std::unique_ptr<Simulation> simulation = Simulation::create(world).value();
  simulation->report_contacts(true);
  for (std::uint64_t tick = 1; tick <= kTicks; ++tick) {
    simulation->step();
    for (const ContactEvent& event : simulation->contact_events()) {
      if (event.phase == ContactPhase::kPersist) continue;
      expected.emplace_back(tick, event.trigger, event.phase == ContactPhase::kEnd, event.a.value,
                            event.b.value);
    }
  }
  ASSERT_FALSE(expected.empty());

  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(world).status(), IsOk());
  const std::unique_ptr<ContactStream> stream = cluster.client->watch_contacts({}, kPatience).value();
  ASSERT_THAT(cluster.client->step(kTicks, kPatience).status(), IsOk());
  std::vector<Event> told;
  for (Tick tick = 0; tick < kTicks;) {
    const absl::StatusOr<ContactFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    tick = frame->tick;
    for (const ContactSample& contact : frame->contacts) {
      told.emplace_back(tick, contact.trigger, contact.phase == ContactPhase::kEnd, contact.a.value,
                        contact.b.value);
    }
  }
  std::sort(expected.begin(), expected.end());
  std::sort(told.begin(), told.end());
  EXPECT_EQ(told, expected);
}

INSTANTIATE_TEST_SUITE_P(OfWorlds, ContactStreamTest, ::testing::Values("busy.sdf", "zones.sdf"));

TEST(BodyStreamTest, EndsWhenTheWorldIsReplaced) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("falling.sdf")).status(), IsOk());
  const std::unique_ptr<BodyStream> stream = cluster.client->watch_bodies({}, kPatience).value();
  ASSERT_THAT(cluster.client->step(3).status(), IsOk());
  ASSERT_THAT(cluster.client->load(read_world("falling.sdf"), true).status(), IsOk());
  ASSERT_THAT(cluster.client->step(3).status(), IsOk());
  absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
  while (frame.ok()) frame = stream->next(kPatience);
  EXPECT_THAT(frame.status(), IsStatus(absl::StatusCode::kAborted, "replaced"));
}

TEST(BodyStreamTest, NothingToWatchIsAnError) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  EXPECT_THAT(cluster.client->watch_bodies().status(),
              IsStatus(absl::StatusCode::kFailedPrecondition, "no world is loaded"));
}

TEST(BodyStreamTest, ServerWithoutAPartInTheWorldIsNotWaitedFor) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("falling.sdf")).status(), IsOk());
  ASSERT_THAT(cluster.processes->start_server(), IsOk());
  ASSERT_TRUE(await_joined(cluster, 2));
  const ClusterStatus status = client.status().value();
  ASSERT_EQ(status.servers.size(), 2u);
  EXPECT_TRUE(status.servers[0].takes_part);
  EXPECT_FALSE(status.servers[1].takes_part);

  const std::unique_ptr<BodyStream> stream = client.watch_bodies({}, kPatience).value();
  ASSERT_THAT(client.step(3, kPatience).status(), IsOk());
  for (Tick tick = 0; tick <= 3; ++tick) EXPECT_EQ(stream->next(kPatience).value().tick, tick);
}

TEST(BodyStreamTest, ClientThatVanishesLeavesTheClusterRunning) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("busy.sdf")).status(), IsOk());
  ASSERT_THAT(client.resume().status(), IsOk());
  Process watcher("tessera", {"watch", "--connect", cluster.processes->address()});
  ASSERT_TRUE(watcher.await_output("m/s")) << watcher.output();
  watcher.process().signal(SIGKILL);
  EXPECT_EQ(watcher.wait(), -SIGKILL);
  const Tick tick = client.pause(kPatience).value();
  EXPECT_EQ(client.step(60, kPatience).value(), tick + 60);
  EXPECT_THAT(client.watch_bodies({}, kPatience).status(), IsOk());
}

TEST(BodyStreamTest, ServerThatIsKilledEndsStreamAndWorldWithItsName) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("busy.sdf")).status(), IsOk());
  const std::unique_ptr<BodyStream> stream = client.watch_bodies({}, kPatience).value();
  const Processes killed({cluster.processes->server(1)});
  ASSERT_EQ(kill(cluster.processes->server(1), SIGKILL), 0);

  const absl::Status stepped = client.step(1'000'000, kPatience).status();
  EXPECT_EQ(stepped.code(), absl::StatusCode::kUnavailable) << stepped;
  absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
  while (frame.ok()) frame = stream->next(kPatience);
  EXPECT_THAT(frame.status(), IsStatus(absl::StatusCode::kUnavailable, "127.0.0.1:"));

  const ClusterStatus status = client.status().value();
  EXPECT_EQ(status.state, "failed");
  EXPECT_FALSE(status.failure.empty());
  EXPECT_EQ(status.servers.size(), 1u);
  EXPECT_TRUE(killed.await_end());
  EXPECT_THAT(cluster.processes->failure(), IsStatus(absl::StatusCode::kUnavailable, "signal 9"));

  // The coordinator continues: once another server joins, the world can be loaded again.
  ASSERT_THAT(cluster.processes->start_server(), IsOk());
  ASSERT_THAT(client.load(read_world("busy.sdf"), true).status(), IsOk());
  EXPECT_EQ(client.step(10, kPatience).value(), 10u);
}

}  // namespace
}  // namespace tessera
