// Replaying recorded inputs gives the same bits, on any number of servers.
#include <functional>

#include "lpss/programs/registry.h"
#include "proto/recording_file.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

class RecordingTest : public ::testing::Test {
 protected:
  RecordingTest() : folder_(cli::make_temporary_folder().value()) {}
  ~RecordingTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  Cluster start_recording(int servers) const {
    cli::LocalClusterOptions options;
    options.record_inputs = file();
    return start_cluster(servers, options);
  }
  std::filesystem::path file() const { return folder_ / "inputs.rec"; }

  std::filesystem::path folder_;
};

// A thousand commands of all kinds: most while the world is paused, ten per tick, the last hundred while it
// runs.
void stir(Client& client) {
  constexpr std::uint64_t kCommands = 1000;
  constexpr std::uint64_t kStanding = 900;
  const std::vector<FoundBody> bodies = client.find_bodies("").value().bodies;
  std::vector<BodyId> movable;
  for (const FoundBody& body : bodies) {
    if (body.properties.motion == Motion::kDynamic) movable.push_back(body.id);
  }
  for (std::uint64_t n = 0; n < kCommands; ++n) {
    const BodyId body = movable[n * 7 % movable.size()];
    const double way = static_cast<double>(n % 5) - 2;
    const std::string name = absl::StrCat("guest", n);
    if (n < kStanding && n % 10 == 0) {
      ASSERT_THAT(client.step(1, kPatience).status(), IsOk());
    } else if (n == kStanding) {
      ASSERT_THAT(client.resume(/*real_time_factor=*/0).status(), IsOk());
    }
    switch (n % 10) {
      case 0:
        ASSERT_THAT(client.spawn(solid(name, sphere(0.3), 3, {{0, 0, 0}, {way, -way, 9}})).status(), IsOk());
        break;
      case 1:
        ASSERT_THAT(client
                        .teleport(absl::StrCat("guest", n - 1),
                                  {{{0, 0, 0}, {way, way, 12}}, Eigen::Quaterniond::Identity()})
                        .status(),
                    IsOk());
        break;
      case 2:
        ASSERT_THAT(client.set_velocity(body, {way, 0, 3}, {0, 0, 1}).status(), IsOk());
        break;
      case 3:
        ASSERT_THAT(client.apply_force(body, {0, 500 * way, 0}).status(), IsOk());
        break;
      case 9:
        ASSERT_THAT(client.remove(absl::StrCat("guest", n - 9)).status(), IsOk());
        break;
      default:
        ASSERT_THAT(client.apply_impulse(body, {4 * way, 0, 8}, {0.1, 0, 0}).status(), IsOk());
    }
  }
}

TEST_F(RecordingTest, ThousandCommandsOnTwoServersEndInTheSameBitsOnOne) {
  {
    const Cluster cluster = start_recording(2);
    ASSERT_TRUE(cluster.client);
    Client& client = *cluster.client;
    ASSERT_THAT(client.load(read_world("busy.sdf")).status(), IsOk());
    ASSERT_NO_FATAL_FAILURE(stir(client));
    ASSERT_THAT(client.pause(kPatience).status(), IsOk());
    ASSERT_THAT(client.hash().status(), IsOk());
    ASSERT_THAT(client.shutdown(), IsOk());
    ASSERT_THAT(cluster.processes->wait_until_ended(kPatience), IsOk());
  }
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--in-process"}, std::vector<std::string>{"--servers", "1"}}) {
    std::vector<std::string> arguments = {"replay", file().string()};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr("1,000 commands"));
    EXPECT_THAT(outcome.output, HasSubstr("the same hash"));
  }
}

TEST_F(RecordingTest, EveryWorldIsPlayedAndTheFirstDifferenceTold) {
  {
    const Cluster cluster = start_recording(1);
    ASSERT_TRUE(cluster.client);
    Client& client = *cluster.client;
    ASSERT_THAT(client.load(read_world("falling.sdf")).status(), IsOk());
    ASSERT_THAT(client.step(10, kPatience).status(), IsOk());
    ASSERT_THAT(client.load(flat_world(10), true).status(), IsOk());
    NewBody crate = solid("crate", box(1, 1, 1), 123.25, {{0, 0, 0}, {0, 0, 3}});
    crate.body.programs = {*new_program("imu")};
    ASSERT_THAT(client.spawn(crate).status(), IsOk());
    ASSERT_THAT(client.step(20, kPatience).status(), IsOk());
    // Answers come in order: after this one, that of the last tick has arrived.
    ASSERT_THAT(client.hash().status(), IsOk());
  }
  EXPECT_THAT(
      run_tessera({"up", "--listen", "127.0.0.1:0", "--no-page", "--record-inputs", file().string()}).output,
      HasSubstr("recordings are not overwritten"));
  const Outcome played = run_tessera({"replay", file().string()});
  EXPECT_EQ(played.code, 0) << played.output;
  EXPECT_THAT(played.output, HasSubstr("flat: 1 commands, 20 ticks"));
  EXPECT_THAT(played.output, HasSubstr("all 30 that have one"));

  const std::filesystem::path other = folder_ / "other.rec";
  const auto played_with = [&](const std::function<void(v1::RecordedHash&)>& change) {
    RecordingReader reader = RecordingReader::open(file()).value();
    std::filesystem::remove(other);
    {
      RecordingWriter writer = RecordingWriter::create(other).value();
      while (std::optional<v1::RecordedInput> input = reader.next().value()) {
        if (input->has_hash()) change(*input->mutable_hash());
        EXPECT_THAT(writer.write(*input), IsOk());
      }
    }
    return run_tessera({"replay", other.string()});
  };
  const Outcome differs = played_with([](v1::RecordedHash& hash) {
    if (hash.tick() == 7) hash.set_hash(std::string(32, '0'));
  });
  EXPECT_EQ(differs.code, 1);
  EXPECT_THAT(differs.output, HasSubstr("tick 7: the world has the hash"));
  const Outcome thinks = played_with([](v1::RecordedHash& hash) {
    if (hash.tick() == 15 && !hash.programs().empty()) hash.set_programs(std::string(32, '0'));
  });
  EXPECT_EQ(thinks.code, 1);
  EXPECT_THAT(thinks.output, HasSubstr("tick 15: its programs have the hash"));

  std::filesystem::resize_file(file(), std::filesystem::file_size(file()) - 5);
  const Outcome cut = run_tessera({"replay", file().string()});
  EXPECT_EQ(cut.code, 1);
  EXPECT_THAT(cut.output, HasSubstr("is truncated at byte"));
  EXPECT_THAT(run_tessera({"replay", world_file("falling.sdf").string()}).output,
              HasSubstr("is not a recording of inputs"));
  EXPECT_THAT(run_tessera({"replay", "nowhere.rec"}).output, HasSubstr("nowhere.rec"));
}

}  // namespace
}  // namespace tessera
