// Clients that reach a gateway and no other daemon.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <regex>
#include <set>

#include "daemon/test_http.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

std::unique_ptr<Client> connect(const std::string& address, const std::filesystem::path& keys = {}) {
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(address, kPatience, keys);
  EXPECT_THAT(client.status(), IsOk());
  return client.ok() ? *std::move(client) : nullptr;
}

// A gateway whose metrics are served.
class MeasuredGateway {
 public:
  explicit MeasuredGateway(const std::string& coordinator)
      : program_("tessera-gateway",
                 {"--connect", coordinator, "--listen", "127.0.0.1:0", "--metrics-address", "127.0.0.1:0"}) {
    EXPECT_TRUE(program_.await_output("/metrics")) << program_.output();
  }

  std::string address() const { return said("clients on ([0-9.:]+)"); }
  // Of service Streams.
  double streamed(const std::string& metric) const {
    const std::string text = http_get(said("metrics on http://([0-9.:]+)/"), "/metrics").body;
    const std::regex line(
        absl::StrCat("\ntessera_gateway_", metric, "\\{service=\"Streams\"\\} ([0-9.e+]+)"));
    std::smatch found;
    double value = -1;
    EXPECT_TRUE(std::regex_search(text, found, line) && absl::SimpleAtod(found[1].str(), &value)) << text;
    return value;
  }

 private:
  std::string said(const std::string& pattern) const {
    const std::string log = program_.output();
    std::smatch found;
    EXPECT_TRUE(std::regex_search(log, found, std::regex(pattern))) << log;
    return found[1];
  }

  Process program_;
};

constexpr double kSector = 4;  // m
constexpr int kSectors = 100;
constexpr double kLane = 3;    // m, of crates beside the way
constexpr double kSpeed = 40;  // m/s

// A sledge on its way through a row of sectors, in each of which a crate stands.
WorldDescription avenue() {
  WorldDescription world = flat_world(kSector);
  for (int n = 0; n < kSectors; ++n) {
    add(world, solid(absl::StrCat("crate", n), box(1, 1, 1), 10, {{0, 0, 0}, {n * kSector, kLane, 0.5}}));
  }
  BodyDescription& sledge = add(world, solid("sledge", box(1, 1, 1), 10, {{0, 0, 0}, {0, 0, 3}}));
  sledge.properties.motion = Motion::kKinematic;
  return world;
}

double along(const BodySample& body) { return relative_to(body.pose.position, SectorIndex{}, kSector).x(); }

// Of a frame: where the body is that is followed, once. Nothing twice, and nothing outside the box around it.
double place_in(const BodyFrame& frame, BodyId followed, double half) {
  std::set<BodyId> ids;
  double here = NAN;
  for (const BodySample& body : frame.bodies) {
    EXPECT_TRUE(ids.insert(body.id).second) << "twice: " << body.id.value << " at tick " << frame.tick;
    if (body.id == followed) here = along(body);
  }
  EXPECT_FALSE(std::isnan(here)) << "tick " << frame.tick;
  for (const BodySample& body : frame.bodies) EXPECT_LE(std::abs(along(body) - here), half);
  return here;
}

// How many crates are in the box.
std::size_t crates_around(double here, double half) {
  std::size_t crates = 0;
  for (int n = 0; n < kSectors; ++n) crates += std::abs(n * kSector - here) <= half ? 1 : 0;
  return crates;
}

TEST(OneAddressTest, ABodyIsFollowedOverAHundredSectorsAndFourServers) {
  constexpr double kHalf = 12.3;  // m; no crate comes to stand at its edge
  constexpr double kBytesPerFrameMax = 2000;
  const Cluster cluster = start_cluster(4, {.balance_every = absl::ZeroDuration()});
  ASSERT_TRUE(cluster.client);
  const MeasuredGateway gateway(cluster.processes->address());
  const std::unique_ptr<Client> client = connect(gateway.address());
  ASSERT_TRUE(client);
  ASSERT_THAT(client->load(avenue()).status(), IsOk());
  ASSERT_THAT(client->step(1, kPatience).status(), IsOk());
  const BodyId sledge = client->find("sledge").value().id;
  BodyFilter filter;
  filter.follow = sledge;
  filter.region = {{.centre = {}, .half_size = {kHalf, kHalf, kHalf}}};
  filter.complete = true;
  const std::unique_ptr<BodyStream> stream = client->watch_bodies(filter, kPatience).value();
  const double bytes_before = gateway.streamed("reply_bytes_total");
  ASSERT_THAT(client->set_velocity(sledge, {kSpeed, 0, 0}, Eigen::Vector3d::Zero()).status(), IsOk());
  ASSERT_THAT(client->resume(1).status(), IsOk());

  std::set<std::int64_t> sectors;
  std::set<std::uint64_t> servers;
  Tick tick = 0;
  int frames = 0;
  for (double here = 0; here < (kSectors - 1) * kSector;) {
    const absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    if (tick != 0) {
      ASSERT_EQ(frame->tick, tick + 1);
    }
    tick = frame->tick;
    ++frames;
    here = place_in(*frame, sledge, kHalf);
    ASSERT_FALSE(std::isnan(here));
    const auto leader = std::find_if(frame->bodies.begin(), frame->bodies.end(),
                                     [&](const BodySample& body) { return body.id == sledge; });
    sectors.insert(leader->pose.position.sector.i);
    servers.insert(leader->server);
  }
  // Where this machine is slow, what is around the body may have come late; once it stands, all is there.
  ASSERT_THAT(client->set_velocity(sledge, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()).status(),
              IsOk());
  for (bool is_whole = false; !is_whole;) {
    const absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    ASSERT_EQ(frame->tick, ++tick);
    is_whole = frame->bodies.size() == 1 + crates_around(place_in(*frame, sledge, kHalf), kHalf);
  }
  EXPECT_EQ(stream->skipped(), 0u);
  EXPECT_GE(sectors.size(), static_cast<std::size_t>(kSectors - 1));
  EXPECT_EQ(servers.size(), 4u);
  const double bytes = gateway.streamed("reply_bytes_total") - bytes_before;
  EXPECT_LT(bytes / frames, kBytesPerFrameMax);
  EXPECT_GE(gateway.streamed("calls_total"), 8);  // all streams: four of the body, four of a region, and more
  std::printf("%d frames, %zu sectors, %zu servers, %.0f bytes in %.0f streams\n", frames, sectors.size(),
              servers.size(), bytes, gateway.streamed("calls_total"));
}

TEST(OneAddressTest, AStreamKeepsItsBudgetAndKnowsAllThatRestsInTheEnd) {
  constexpr std::uint64_t kBytesPerSecond = 30'000;
  constexpr int kCrates = 150;
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  WorldDescription world = flat_world(8);
  for (int n = 0; n < kCrates; ++n) {
    const Eigen::Vector3d place(2.0 * (n % 15 - 7), 2.0 * (n / 15 - 5), 1.0 + 0.01 * n);
    add(world, solid(absl::StrCat("crate", n), box(1, 1, 1), 10, {{0, 0, 0}, place}));
  }
  ASSERT_THAT(cluster.client->load(world).status(), IsOk());
  const MeasuredGateway gateway(cluster.processes->address());
  const std::unique_ptr<Client> client = connect(gateway.address());
  ASSERT_TRUE(client);
  BodyFilter filter;
  filter.complete = true;
  filter.bytes_per_second = kBytesPerSecond;
  const absl::Time begin = absl::Now();
  const std::unique_ptr<BodyStream> stream = client->watch_bodies(filter, kPatience).value();
  ASSERT_THAT(client->resume(1).status(), IsOk());
  std::uint64_t most = 0;
  BodyFrame last;
  for (bool is_at_rest = false; !is_at_rest;) {
    absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    last = *std::move(frame);
    most = std::max(most, last.deferred);
    is_at_rest = last.deferred == 0 && last.bodies.size() == kCrates &&
                 std::all_of(last.bodies.begin(), last.bodies.end(),
                             [](const BodySample& body) { return body.asleep; });
  }
  const double seconds = absl::ToDoubleSeconds(absl::Now() - begin);
  const double bytes = gateway.streamed("reply_bytes_total");
  EXPECT_LE(bytes, static_cast<double>(kBytesPerSecond) * (seconds + 1));
  EXPECT_GT(most, 0u);
  std::printf("%.0f bytes in %.1f s, %.0f a second, %d bodies waited at most\n", bytes, seconds,
              bytes / seconds, static_cast<int>(most));
  filter.bytes_per_second = 0;
  const BodyFrame truth = cluster.client->watch_bodies(filter, kPatience).value()->next(kPatience).value();
  ASSERT_EQ(truth.bodies.size(), last.bodies.size());
  for (std::size_t n = 0; n < truth.bodies.size(); ++n) {
    EXPECT_EQ(last.bodies[n].id, truth.bodies[n].id);
    EXPECT_EQ(last.bodies[n].pose.position.local, truth.bodies[n].pose.position.local);
    EXPECT_EQ(last.bodies[n].pose.orientation.coeffs(), truth.bodies[n].pose.orientation.coeffs());
  }
  filter.bytes_per_second = 19'999;
  EXPECT_THAT(client->watch_bodies(filter, kPatience).status(),
              IsStatus(absl::StatusCode::kInvalidArgument, "at least 10000 for each of 2 servers"));
}

TEST(OneAddressTest, CommandsAndQueriesGoOnAfterTheCoordinatorIsReplaced) {
  const Cluster cluster =
      start_cluster(2, {.gateways = {"127.0.0.1:0"}, .checkpoint_every = absl::Seconds(1), .store = true});
  ASSERT_TRUE(cluster.client);
  const std::unique_ptr<Client> client = connect(cluster.processes->gateways().front());
  ASSERT_TRUE(client);
  ASSERT_THAT(client->load(read_world("busy.sdf")).status(), IsOk());
  const std::unique_ptr<BodyStream> stream = client->watch_bodies({}, kPatience).value();
  ASSERT_EQ(client->step(20, kPatience).value(), 20u);
  ASSERT_EQ(kill(cluster.processes->coordinator(), SIGKILL), 0);
  ASSERT_THAT(cluster.processes->replace_coordinator(), IsOk());
  ASSERT_EQ(client->step(20, kPatience).value(), 40u);
  EXPECT_EQ(client->hash(kPatience).value().hash, hash_in_process(read_world("busy.sdf"), 40));
  for (Tick tick = 0; tick <= 40; ++tick) {
    const absl::StatusOr<BodyFrame> frame = stream->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    ASSERT_EQ(frame->tick, tick);
  }
}

TEST(OneAddressTest, WithKeysEachClientHasItsOwnRole) {
  const TestKeys keys;
  const Cluster cluster = start_cluster(1, {.gateways = {"127.0.0.1:0"}, .keys = keys.folder()});
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("falling.sdf")).status(), IsOk());
  const std::string& gateway = cluster.processes->gateways().front();
  const std::unique_ptr<Client> observer = connect(gateway, keys.folder() / "observe");
  const std::unique_ptr<Client> admin = connect(gateway, keys.folder() / "admin");
  ASSERT_TRUE(observer && admin);
  const std::unique_ptr<BodyStream> stream = observer->watch_bodies({}, kPatience).value();
  EXPECT_THAT(stream->next(kPatience).status(), IsOk());
  EXPECT_THAT(observer->step(1, kPatience).status(),
              IsStatus(absl::StatusCode::kPermissionDenied, "the role observe may not change a world"));
  EXPECT_THAT(observer->unload(), IsStatus(absl::StatusCode::kPermissionDenied, "it needs admin"));
  EXPECT_THAT(admin->step(1, kPatience).status(), IsOk());
  EXPECT_THAT(admin->unload(), IsOk());
  // A certificate alone ends at the gateway; no keys, and those of others, do not get that far.
  std::filesystem::remove(keys.folder() / "control" / kTokenFile);
  const std::unique_ptr<Client> certified = connect(gateway, keys.folder() / "control");
  ASSERT_TRUE(certified);
  EXPECT_THAT(certified->status().status(), IsStatus(absl::StatusCode::kUnauthenticated, "needs the token"));
  const TestKeys others;
  EXPECT_EQ(Client::connect(gateway, absl::Milliseconds(300), others.folder()).status().code(),
            absl::StatusCode::kUnavailable);
}

TEST(OneAddressTest, ALostGatewayIsTold) {
  Process up("tessera",
             {"up", "--servers", "1", "--no-page", "--listen", "127.0.0.1:0", "--gateway", "127.0.0.1:0"});
  ASSERT_TRUE(up.await_output("a cluster is up")) << up.output();
  EXPECT_THAT(up.output(), HasSubstr("a gateway, which is enough"));
  for (const pid_t child : children_of(up.process().pid())) {
    if (name_of(child) == "tessera-gateway") kill(child, SIGKILL);
  }
  EXPECT_TRUE(up.await_output("a gateway is lost")) << up.output();
  up.process().signal(SIGINT);
  up.wait();
}

}  // namespace
}  // namespace tessera
