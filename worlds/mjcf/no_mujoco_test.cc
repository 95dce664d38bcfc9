// A build without MuJoCo says what is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera::mjcf {
namespace {

TEST(MjcfWithoutMujoco, NamesThePackage) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string("<mujoco/>", "/");
  EXPECT_EQ(loaded.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(loaded.status().message(), testing::HasSubstr("libmujoco-dev"));
}

}  // namespace
}  // namespace tessera::mjcf
