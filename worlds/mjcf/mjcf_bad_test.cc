// Files of MuJoCo with faults.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "worlds/loader/world_text_for_tests.h"

namespace tessera::mjcf {
namespace {

using testing::AllOf;
using testing::HasSubstr;

absl::Status error_of(const std::string& xml, const std::filesystem::path& folder = "/") {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(xml, folder);
  EXPECT_FALSE(loaded.ok());
  return loaded.status();
}

TEST(MjcfBad, ErrorsOfMujocoNameTheirPlace) {
  const absl::Status status =
      error_of("<mujoco>\n<worldbody>\n\n<body name='b'>\n<freejoint/>\n</body></worldbody></mujoco>");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("<string>:4: <body name='b'>: MuJoCo:"), HasSubstr("mass")));
  EXPECT_THAT(error_of("<mujoco><worldbody>\n<geom size='a b'/></worldbody></mujoco>").message(),
              HasSubstr("<string>:2: <geom>: MuJoCo: XML Error: problem reading attribute 'size'"));
}

TEST(MjcfBad, ErrorsInIncludedFilesNameThose) {
  const Folder folder;
  folder.write("part.xml", "<mujoco>\n<worldbody>\n<geom type='blob' size='1'/></worldbody></mujoco>");
  EXPECT_THAT(error_of("<mujoco>\n<include file='part.xml'/></mujoco>", folder).message(),
              HasSubstr("part.xml:3: <geom>: MuJoCo: XML Error: invalid keyword: 'blob'"));
}

TEST(MjcfBad, FilesThatAreNotThereAreAllNamed) {
  const absl::Status status = error_of(
      "<mujoco><asset><mesh name='a' file='a.stl'/><mesh name='b' "
      "file='b.stl'/></asset><worldbody/></mujoco>");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr("2 files were not found"), HasSubstr("a.stl"), HasSubstr("b.stl")));
  EXPECT_EQ(error_of("<mujoco><include file='none.xml'/></mujoco>").code(), absl::StatusCode::kNotFound);
}

TEST(MjcfBad, IncludesThatIncludeThemselvesEnd) {
  const Folder folder;
  folder.write("a.xml", "<mujoco><include file='a.xml'/></mujoco>");
  EXPECT_THAT(error_of("<mujoco><include file='a.xml'/></mujoco>", folder).message(),
              HasSubstr("includes are nested deeper than 16"));
}

TEST(MjcfBad, WhatWouldTakeAllMemoryIsRefused) {
  EXPECT_THAT(
      error_of("<mujoco><worldbody><body><composite type='grid' count='1000 1000 1' spacing='1'/></body>"
               "</worldbody></mujoco>")
          .message(),
      HasSubstr("its 1e+06 elements must be at most 10000"));
  EXPECT_THAT(error_of("<mujoco><asset><hfield name='h' nrow='100000' ncol='100000' size='1 1 1 1'/></asset>"
                       "<worldbody/></mujoco>")
                  .message(),
              HasSubstr("its 1e+10 samples must be at most 100000000"));
}

TEST(MjcfBad, AFileWithoutAnythingIsRefused) {
  EXPECT_THAT(error_of("<mujoco><worldbody/></mujoco>").message(), HasSubstr("there is no body in it"));
}

TEST(MjcfBad, LostBodiesAreFaultsForWhoWantsNone) {
  const std::string xml =
      "<mujoco><worldbody><geom size='1'/><replicate count='3'><geom "
      "size='1'/></replicate></worldbody></mujoco>";
  EXPECT_TRUE(load_world_string(xml, "/").ok());
  const absl::StatusOr<LoadedWorld> refused = load_world_string(xml, "/", Faults::kRefuse);
  EXPECT_THAT(refused.status().message(), HasSubstr("<replicate>"));
}

}  // namespace
}  // namespace tessera::mjcf
