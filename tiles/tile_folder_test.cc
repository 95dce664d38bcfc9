#include "tiles/tile_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cstdlib>
#include <fstream>
#include <map>

#include "tiles/mesh_tile.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class TileFolder : public ::testing::Test {
 protected:
  TileFolder() {
    std::string name = (fs::temp_directory_path() / "tilesXXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~TileFolder() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  // A slope of 5 x 3 pixels that rises by `step` along x, from `first`.
  void write_image(const std::string& name, std::uint8_t first, std::uint8_t step,
                   png_uint_32 rows = 3) const {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.format = PNG_FORMAT_GRAY;
    image.width = 5;
    image.height = rows;
    std::vector<std::uint8_t> pixels;
    for (png_uint_32 n = 0; n < 5 * rows; ++n)
      pixels.push_back(static_cast<std::uint8_t>(first + n % 5 * step));
    ASSERT_TRUE(png_image_write_to_file(&image, (folder_ / name).c_str(), 0, pixels.data(), 0, nullptr));
  }

  Ground ground() const {
    return {.source = Ground::Source::kFolder,
            .height = 245,
            .folder = folder_.string(),
            .edge = 100,
            .low = -10};
  }

  fs::path folder_;
};

Eigen::AlignedBox3d around(const Eigen::Vector3d& centre, double half) {
  return {centre - Eigen::Vector3d::Constant(half), centre + Eigen::Vector3d::Constant(half)};
}

TEST_F(TileFolder, HasTheHeightsOfImages) {
  write_image("0_0.png", 10, 5);
  write_image("1_0.png", 30, 5);
  write("notes.txt", "no tile");
  const Ground described = described_folder(ground()).value();
  EXPECT_EQ(described.spacing, 25);
  const auto source = open_tile_folder(described).value();
  ASSERT_EQ(source->overlapping(around({50, 50, 0}, 20)).size(), 1u);
  const std::vector<TileKey> both = source->overlapping(around({100, 50, 0}, 20));
  ASSERT_EQ(both.size(), 2u);
  const Tile west = source->make(both[0]).value();
  const Tile east = source->make(both[1]).value();
  EXPECT_EQ(west.triangles.size(), 16u);
  EXPECT_EQ(west.vertices[0], Eigen::Vector3d(0, 0, 0));  // -10 m, and 10 of 255 steps of 1 m
  EXPECT_EQ(west.vertices[4], Eigen::Vector3d(100, 0, 20));
  EXPECT_EQ(west.vertices[4], east.vertices[0]);
  EXPECT_NE(west.name, east.name);
}

TEST_F(TileFolder, HasTheTrianglesOfMeshes) {
  write("a.obj", "# hill\nv 0 0 0\nv 10 0 0\nv 10 10 2\nv 0 10 0\nf 1/1 2/1 3/1 4/1\n");
  write("b.obj", "v 1000 0 0\nv 1010 0 0\nv 1010 10 2\nf -3 -2 -1\n");
  const auto source = open_tile_folder(described_folder(ground()).value()).value();
  const std::vector<TileKey> keys = source->overlapping(around({5, 5, 0}, 3));
  ASSERT_EQ(keys.size(), 1u);
  EXPECT_EQ(source->make(keys[0])->triangles.size(), 2u);
  EXPECT_TRUE(source->overlapping(around({500, 5, 0}, 3)).empty());
}

TEST_F(TileFolder, KnowsThatItHasChanged) {
  write("a.obj", "v 0 0 0\nv 10 0 0\nv 10 10 2\nf 1 2 3\n");
  const Ground described = described_folder(ground()).value();
  const auto source = open_tile_folder(described).value();
  write("a.obj", "v 0 0 0\nv 10 0 0\nv 10 10 3\nf 1 2 3\n");
  EXPECT_EQ(source->make({}).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(open_tile_folder(described).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(TileFolder, SaysWhatIsWrong) {
  EXPECT_THAT(open_tile_folder(ground()).status().message(), HasSubstr("no tiles"));
  Ground nowhere = ground();
  nowhere.folder = "/nowhere";
  EXPECT_EQ(open_tile_folder(nowhere).status().code(), absl::StatusCode::kNotFound);
  write("0_0.png", "text");
  EXPECT_THAT(open_tile_folder(ground()).status().message(), HasSubstr("0_0.png: it must be a PNG image"));
  write_image("0_0.png", 10, 5);
  write_image("1_0.png", 10, 5, 4);
  EXPECT_THAT(open_tile_folder(ground()).status().message(),
              HasSubstr("1_0.png: all images must be of one size"));
}

TEST(MeshTile, NamesTheLine) {
  const std::map<std::string, std::string> cases = {
      {"v 0 0\n", "line 1: a vertex must have 3 numbers"},
      {"v 0 0 x\n", "line 1: 'x' must be a number"},
      {"v 0 0 nan\n", "line 1: 'nan' must be a number"},
      {"v 0 0 1e30\n", "at most 1e+08 m"},
      {"v 0 0 0\nf 1 1\n", "line 2: a face must have 3 corners"},
      {"v 0 0 0\nf 1 1 2\n", "line 2: '2' must be a vertex before, 1 to 1"},
      {"v 0 0 0\nf 0 1 1\n", "'0' must be a vertex"},
      {"v 0 0 0\nf -2 1 1\n", "'-2' must be a vertex"},
  };
  for (const auto& [text, message] : cases)
    EXPECT_THAT(read_obj(text).status().message(), HasSubstr(message)) << text;
}

}  // namespace
}  // namespace tessera
