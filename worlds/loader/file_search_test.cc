// A world of a stranger reads no file but its own.
#include "worlds/loader/file_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

#include "worlds/loader/mesh_file.h"

namespace tessera {
namespace {

using std::filesystem::path;
using ::testing::HasSubstr;

class FileSearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "tessera-search-XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    top_ = name;
    write("secret");
    write("stranger/world.sdf");
    write("stranger/meshes/own.stl");
  }
  void TearDown() override { std::filesystem::remove_all(top_); }

  void write(const std::string& file) {
    std::filesystem::create_directories((top_ / file).parent_path());
    std::ofstream(top_ / file) << "content";
  }
  void expect_refused(const std::string& uri) {
    const absl::StatusOr<path> found = find_uri(uri, top_ / "stranger");
    EXPECT_EQ(found.status().code(), absl::StatusCode::kInvalidArgument) << uri << ": " << found.status();
    EXPECT_THAT(std::string(found.status().message()), HasSubstr(uri));
    EXPECT_FALSE(find_model(uri, top_ / "stranger").ok()) << uri;
  }

  path top_;
};

TEST_F(FileSearchTest, WhatLiesBesideAFileIsFound) {
  for (const char* uri :
       {"meshes/own.stl", "file://meshes/own.stl", "model://meshes/own.stl", "./meshes/../meshes/own.stl"}) {
    EXPECT_TRUE(find_uri(uri, top_ / "stranger").ok()) << uri;
  }
  EXPECT_TRUE(find_uri((top_ / "stranger/meshes/own.stl").string(), top_ / "stranger").ok());
}

TEST_F(FileSearchTest, WhatLiesElsewhereIsNot) {
  for (const std::string& uri :
       {std::string("../secret"), std::string("file://../secret"), std::string("meshes/../../secret"),
        (top_ / "secret").string(), "file://" + (top_ / "secret").string(), std::string("/etc/passwd"),
        std::string("file:///etc/passwd"), std::string("model://../secret"),
        std::string("package://a/../../secret")}) {
    expect_refused(uri);
  }
}

TEST_F(FileSearchTest, OneSlashMoreBeforeTheNameOfAModelIsNothing) {
  EXPECT_TRUE(find_uri("model:///meshes/own.stl", top_ / "stranger").ok());
  EXPECT_TRUE(find_uri("package:///meshes/own.stl", top_ / "stranger").ok());
  EXPECT_FALSE(find_uri("model:///etc/passwd", top_ / "stranger").ok());
  EXPECT_FALSE(find_uri("model:////etc/passwd", top_ / "stranger").ok());
}

TEST_F(FileSearchTest, AModelThatIsNotThereIsNotTheOneThatAsksForIt) {
  write("arm_demo/model.config");
  write("arm_demo/model.sdf");
  EXPECT_EQ(find_model("model://arm", top_ / "arm_demo").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(FileSearchTest, LinksLeadNowhereElse) {
  std::filesystem::create_symlink(top_ / "secret", top_ / "stranger/meshes/link.stl");
  std::filesystem::create_symlink("/etc", top_ / "stranger/etc");
  expect_refused("meshes/link.stl");
  expect_refused("model://meshes/link.stl");
  expect_refused("etc/passwd");
  expect_refused("model://etc/passwd");
  std::filesystem::create_symlink("own.stl", top_ / "stranger/meshes/good.stl");
  EXPECT_TRUE(find_uri("meshes/good.stl", top_ / "stranger").ok());
}

// A folder far above the file, whose name the file may give, is not its package.
TEST_F(FileSearchTest, FoldersFarAboveAreNoPackages) {
  write("user/notes");
  write("user/a/b/c/robot.urdf");
  write("user/a/pictures/mesh.stl");
  EXPECT_FALSE(find_uri("package://user/notes", top_ / "user/a/b/c").ok());
  EXPECT_TRUE(find_uri("package://a/pictures/mesh.stl", top_ / "user/a/b/c").ok());
}

TEST_F(FileSearchTest, TheMessageSaysHowToTrustAFile) {
  const absl::Status refused = find_uri("../secret", top_ / "stranger").status();
  EXPECT_THAT(std::string(refused.message()), HasSubstr("TESSERA_MODEL_PATH"));
  setenv("TESSERA_MODEL_PATH", top_.c_str(), 1);
  EXPECT_TRUE(find_uri("../secret", top_ / "stranger").ok());
  unsetenv("TESSERA_MODEL_PATH");
}

TEST_F(FileSearchTest, PackagesTakeFromTheirOwnFolders) {
  write("arm/package.xml");
  write("arm/meshes/a.stl");
  write("arm/robots/deep/arm.urdf");
  EXPECT_TRUE(find_uri("../../meshes/a.stl", top_ / "arm/robots/deep").ok());
  write("leg/meshes/a.stl");
  write("leg/urdf/leg.urdf");
  EXPECT_TRUE(find_uri("../meshes/a.stl", top_ / "leg/urdf").ok());
  EXPECT_FALSE(find_uri("../../secret", top_ / "leg/urdf").ok());
}

// Reading these may never end.
TEST_F(FileSearchTest, PipesAndDevicesAreNoFiles) {
  ASSERT_EQ(mkfifo((top_ / "stranger/pipe").c_str(), 0600), 0);
  for (const char* uri : {"pipe", "model://pipe", "/dev/zero"})
    EXPECT_FALSE(find_uri(uri, top_ / "stranger").ok()) << uri;
}

// What a world takes in may take from the world's folder, and so on.
TEST_F(FileSearchTest, IncludedFilesTakeFromTheFolderOfTheWorld) {
  write("stranger/parts/part.sdf");
  EXPECT_FALSE(find_uri("../meshes/own.stl", top_ / "stranger/parts").ok());
  const WorldFolder world(top_ / "stranger");
  EXPECT_TRUE(find_uri("../meshes/own.stl", top_ / "stranger/parts").ok());
  EXPECT_FALSE(find_uri("../../secret", top_ / "stranger/parts").ok());
}

TEST_F(FileSearchTest, TheCurrentFolderIsOneToo) {
  const path before = std::filesystem::current_path();
  std::filesystem::current_path(top_ / "stranger");
  {
    const WorldFolder world("");
    EXPECT_TRUE(find_uri("meshes/own.stl", "").ok());
    EXPECT_FALSE(find_uri("../secret", "").ok());
  }
  std::filesystem::current_path(before);
}

// A mesh that names a file of materials which never ends, or lies elsewhere, is read without it.
TEST_F(FileSearchTest, MeshesReadNothingElse) {
  ASSERT_EQ(mkfifo((top_ / "stranger/pipe.mtl").c_str(), 0600), 0);
  for (const char* library : {"pipe.mtl", "../secret", "/dev/zero", "/dev/stdin", "none.mtl"}) {
    std::ofstream(top_ / "stranger/mesh.obj")
        << "mtllib " << library << "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const auto read = read_mesh_file(top_ / "stranger/mesh.obj");
    EXPECT_TRUE(read.ok()) << library << ": " << read.status();
  }
}

}  // namespace
}  // namespace tessera
