#include "viewer/world_shelf.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

namespace tessera::viewer {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class WorldShelfTest : public ::testing::Test {
 protected:
  WorldShelfTest() {
    std::filesystem::create_directories(folder_ / "worlds/models");
    write("worlds/tower.sdf",
          "<?xml version=\"1.0\"?>\n<!--\n  A tower of\n  crates. It stands.\n-->\n<sdf/>");
    write("worlds/bare.sdf", "<sdf/>");
    write("worlds/README.md", "no world");
    write("worlds/models/box.sdf", "<sdf/>");
    write("secret.sdf", "<sdf/>");
  }
  ~WorldShelfTest() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("tessera-shelf-" + std::to_string(getpid()));
  const WorldShelf shelf_{folder_ / "worlds", folder_ / "kept/snapshots"};
};

TEST_F(WorldShelfTest, OffersTheWorldsOfItsFolderWithTheirFirstSentence) {
  const std::vector<ShelfWorld> worlds = shelf_.worlds();
  ASSERT_EQ(worlds.size(), 2);
  EXPECT_EQ(worlds[0].name, "bare");
  EXPECT_EQ(worlds[0].text, "");
  EXPECT_EQ(worlds[1].name, "tower");
  EXPECT_EQ(worlds[1].text, "A tower of crates");
  EXPECT_EQ(shelf_.world("tower").value(), folder_ / "worlds/tower.sdf");
}

TEST_F(WorldShelfTest, NoNameLeadsOutOfItsFolder) {
  for (const char* name : {"", ".", "..", "../secret", "models/box", "README", "/etc/passwd", "tower.sdf"}) {
    EXPECT_EQ(shelf_.world(name).status().code(), absl::StatusCode::kNotFound) << name;
    EXPECT_EQ(shelf_.snapshot(name).status().code(), absl::StatusCode::kNotFound) << name;
  }
  for (const char* name : {"", ".", "..", "../secret", "a/b", ".hidden", "-rf", "a b", "\xc3\xa9"}) {
    const absl::Status status = shelf_.new_snapshot(name).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(status.message(), HasSubstr("name: use 1 to 64 letters"));
  }
  EXPECT_FALSE(shelf_.new_snapshot(std::string(kSnapshotNameMax + 1, 'a')).ok());
}

TEST_F(WorldShelfTest, KeepsSnapshotsUpToALimitAndReplacesNone) {
  EXPECT_THAT(shelf_.snapshots(), IsEmpty());
  for (std::size_t n = 0; n < kShelfMax; ++n) {
    const std::filesystem::path file = shelf_.new_snapshot("n" + std::to_string(100 + n)).value();
    std::ofstream(file) << "four";
  }
  EXPECT_EQ(shelf_.snapshots().front().name, "n100");
  EXPECT_EQ(shelf_.snapshots().front().bytes, 4);
  EXPECT_EQ(shelf_.new_snapshot("n100").status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(shelf_.new_snapshot("more").status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(shelf_.snapshot("n199").value(), folder_ / "kept/snapshots/n199.snapshot");
}

TEST(WorldShelf, OffersNothingWithoutFolders) {
  const WorldShelf shelf("", "");
  EXPECT_THAT(shelf.worlds(), IsEmpty());
  EXPECT_FALSE(shelf.keeps_snapshots());
  EXPECT_EQ(shelf.new_snapshot("a").status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace tessera::viewer
