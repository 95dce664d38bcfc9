// Ground from files, on real servers.
#include <fstream>

#include "tests/cluster_fixture.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

class GroundTest : public ::testing::Test {
 protected:
  GroundTest() : folder_(cli::make_temporary_folder().value()) {
    std::filesystem::create_directory(folder_ / "tiles");
    for (int i = -2; i < 2; ++i) write_tile(i, 0);
  }
  ~GroundTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  // A strip of 200 m along y that slopes to the middle, and is `higher` by so much.
  void write_tile(int i, double higher) const {
    std::ofstream out(folder_ / "tiles" / ("strip_" + std::to_string(i) + ".obj"));
    for (const int x : {100 * i, 100 * i + 100}) {
      for (const int y : {-100, 100})
        out << "v " << x << " " << y << " " << std::abs(x) * 0.1 + higher << "\n";
    }
    out << "f 1 3 4\nf 1 4 2\n";
  }

  absl::StatusOr<LoadedWorld> valley() const {
    return load_world_string(
        "<sdf version='1.9' xmlns:tessera='https://tessera.dev/sdf'><world name='valley'>"
        "<tessera:settings><sector_size>64</sector_size></tessera:settings>"
        "<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry>"
        "<tessera:ground source='folder' folder='tiles'/>"
        "</geometry></collision></link></model></world></sdf>",
        folder_);
  }

  std::filesystem::path folder_;
};

TEST_F(GroundTest, OfFilesIsTheSameOnServersAndItsChangesAreSeen) {
  absl::StatusOr<LoadedWorld> loaded = valley();
  ASSERT_THAT(loaded.status(), IsOk());
  WorldDescription& world = loaded->world;
  for (const double x : {-90, -30, 5, 40, 95}) {
    BodyDescription& ball = add(world, solid("ball" + std::to_string(static_cast<int>(x)), sphere(0.5), 2,
                                             {{0, 0, 0}, {x, x / 3, std::abs(x) * 0.1 + 1}}));
    ball.linear_velocity = {-x / 4, 3, 0};
  }
  constexpr std::uint64_t kTicks = 240;
  const std::string expected = hash_in_process(world, kTicks);
  const Cluster cluster = start_cluster(3);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(world).status(), IsOk());
  ASSERT_THAT(client.step(kTicks, kPatience).status(), IsOk());
  EXPECT_EQ(client.hash().value().hash, expected);
  const auto bottom =
      client.raycast({.origin = {{0, 0, 0}, {0, 50, 20}}, .direction = {0, 0, -1}, .length = 100});
  ASSERT_THAT(bottom.status(), IsOk());
  ASSERT_TRUE(bottom->has_value());
  EXPECT_NEAR((*bottom)->distance, 20, 1e-3);
  std::uint64_t tiles = 0;
  const absl::StatusOr<ClusterStatus> status = client.status();
  ASSERT_THAT(status.status(), IsOk());
  for (const ServerStatus& server : status->servers) tiles += server.ground.tiles;
  EXPECT_GT(tiles, 0u);

  // A snapshot has the description alone, and the checksum of the files.
  ASSERT_THAT(client.snapshot(folder_ / "snapshot").status(), IsOk());
  ASSERT_THAT(client.restore(folder_ / "snapshot", /*replace=*/true).status(), IsOk());
  EXPECT_EQ(client.hash().value().hash, expected);
  write_tile(1, 0.5);
  const absl::Status changed = client.restore(folder_ / "snapshot", /*replace=*/true).status();
  EXPECT_THAT(std::string(changed.message()), HasSubstr("are others than those of the world"));
}

}  // namespace
}  // namespace tessera
