// tessera/c.h, used by a C program.
#include "tessera/world_message.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

TEST(CApiTest, KeepsItsPromises) {
  const std::filesystem::path folder = cli::make_temporary_folder().value();
  const std::filesystem::path world = folder / "tower.pb";
  const std::filesystem::path rovers = folder / "rovers.pb";
  ASSERT_THAT(write_world_message(world, read_world("tower.sdf")), IsOk());
  ASSERT_THAT(write_world_message(rovers, read_world("rover.sdf")), IsOk());
  const std::filesystem::path ferry = folder / "ferry.pb";
  ASSERT_THAT(write_world_message(ferry, read_world("ferry.sdf")), IsOk());
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Process program("c_api_program",
                  {cluster.processes->address(), world.string(), rovers.string(), ferry.string()});
  EXPECT_EQ(program.wait(), 0) << program.output();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tessera
