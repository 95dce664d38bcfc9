#include "tiles/tile_folder.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>
#include <xxhash.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tiles/height_image.h"
#include "tiles/mesh_tile.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPlaceMax = 1'000'000'000;  // of a tile, to each side

std::uint64_t hash_of(const std::string& bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

absl::StatusOr<std::string> contents_of(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return absl::NotFoundError(absl::StrCat(file.string(), ": ", error.message()));
  if (size > kTileFileBytesMax) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ": ", size, " bytes must be at most ", kTileFileBytesMax));
  }
  std::string bytes(size, '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(size)))
    return absl::UnavailableError(absl::StrCat(file.string(), ": cannot be read"));
  return bytes;
}

// Of a name I_J.png.
std::optional<std::pair<std::int64_t, std::int64_t>> place_of(absl::string_view name) {
  if (!absl::ConsumeSuffix(&name, ".png")) return std::nullopt;
  const std::vector<absl::string_view> parts = absl::StrSplit(name, '_');
  std::int64_t i = 0;
  std::int64_t j = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[0], &i) || !absl::SimpleAtoi(parts[1], &j))
    return std::nullopt;
  if (std::max(std::abs(i), std::abs(j)) > kPlaceMax) return std::nullopt;
  return std::pair(i, j);
}

class TileFolder final : public TileSource {
 public:
  static absl::StatusOr<std::unique_ptr<TileFolder>> open(const Ground& ground) {
    auto folder = std::make_unique<TileFolder>(ground);
    if (absl::Status status = folder->list(); !status.ok()) return status;
    for (File& file : folder->files_) {
      if (absl::Status status = folder->look_at(file); !status.ok()) return status;
    }
    return folder;
  }

  explicit TileFolder(const Ground& ground) : ground_(ground) {}

  std::uint64_t checksum() const {
    std::string all;
    for (const File& file : files_) absl::StrAppend(&all, file.name, "/", file.hash, "/");
    return hash_of(all);
  }

  // m, of images; 0 without any.
  double spacing() const { return size_ ? ground_.edge / (std::max(size_->first, size_->second) - 1) : 0; }

  std::vector<TileKey> overlapping(const Eigen::AlignedBox3d& box) const override {
    std::vector<TileKey> keys;
    for (std::size_t n = 0; n < files_.size(); ++n) {
      if (files_[n].box.intersects(box)) keys.push_back({0, static_cast<std::int64_t>(n), 0});
    }
    return keys;
  }

  absl::StatusOr<Tile> make(const TileKey& key) const override {
    const File& file = files_[static_cast<std::size_t>(key.i)];
    const absl::StatusOr<std::string> bytes = contents_of(path_of(file));
    if (!bytes.ok()) return bytes.status();
    if (hash_of(*bytes) != file.hash)
      return absl::DataLossError(
          absl::StrCat(path_of(file).string(), ": it has changed since the ground was opened"));
    return tile_of(file, *bytes);
  }

 private:
  struct File {
    std::string name;
    std::optional<std::pair<std::int64_t, std::int64_t>> place;  // of an image
    std::uint64_t hash = 0;
    Eigen::AlignedBox3d box;  // m
  };

  fs::path path_of(const File& file) const { return fs::path(ground_.folder) / file.name; }

  absl::Status list() {
    std::error_code error;
    for (fs::directory_iterator entry(ground_.folder, error), end; !error && entry != end;
         entry.increment(error)) {
      const std::string name = entry->path().filename();
      const auto place = place_of(name);
      if (!place && !absl::EndsWith(name, ".obj")) continue;
      files_.push_back({name, place, 0, {}});
      if (files_.size() > kTileFilesMax) {
        return absl::InvalidArgumentError(
            absl::StrCat("ground: ", ground_.folder, " must have at most ", kTileFilesMax, " tiles"));
      }
    }
    if (error) return absl::NotFoundError(absl::StrCat("ground: ", ground_.folder, ": ", error.message()));
    if (files_.empty()) {
      return absl::NotFoundError(
          absl::StrCat("ground: ", ground_.folder, " has no tiles: files I_J.png or with the ending .obj"));
    }
    std::ranges::sort(files_, {}, &File::name);
    return absl::OkStatus();
  }

  absl::Status look_at(File& file) {
    const absl::StatusOr<std::string> bytes = contents_of(path_of(file));
    if (!bytes.ok()) return bytes.status();
    file.hash = hash_of(*bytes);
    if (file.place) {
      const absl::StatusOr<std::pair<std::uint32_t, std::uint32_t>> size = size_of_image(*bytes);
      if (!size.ok()) return in_file(file, size.status());
      if (size_ && *size_ != *size)
        return in_file(file, absl::InvalidArgumentError("all images must be of one size"));
      size_ = *size;
      const Eigen::Vector2d corner(static_cast<double>(file.place->first),
                                   static_cast<double>(file.place->second));
      file.box.extend(Eigen::Vector3d(corner.x() * ground_.edge, corner.y() * ground_.edge, ground_.low));
      file.box.extend(
          Eigen::Vector3d((corner.x() + 1) * ground_.edge, (corner.y() + 1) * ground_.edge, ground_.height));
      if (file.box.min().head<2>().cwiseAbs().maxCoeff() > kGroundReach)
        return in_file(file, absl::InvalidArgumentError(absl::StrCat("it lies beyond ", kGroundReach, " m")));
      return absl::OkStatus();
    }
    const absl::StatusOr<Tile> tile = tile_of(file, *bytes);
    if (!tile.ok()) return tile.status();
    for (const Eigen::Vector3d& vertex : tile->vertices) file.box.extend(vertex);
    return absl::OkStatus();
  }

  absl::Status in_file(const File& file, const absl::Status& status) const {
    if (status.ok()) return status;
    return absl::Status(status.code(), absl::StrCat(path_of(file).string(), ": ", status.message()));
  }

  absl::StatusOr<Tile> tile_of(const File& file, const std::string& bytes) const {
    absl::StatusOr<Tile> tile = file.place ? tile_of_image(file, bytes) : read_obj(bytes);
    if (!tile.ok()) return in_file(file, tile.status());
    tile->name = static_cast<std::uint32_t>(hash_of(file.name));
    return tile;
  }

  absl::StatusOr<Tile> tile_of_image(const File& file, const std::string& bytes) const {
    const absl::StatusOr<HeightImage> image = decoded_image(bytes);
    if (!image.ok()) return image.status();
    const std::uint32_t columns = image->columns;
    const std::uint32_t rows = image->rows;
    // A place on a border is counted from the corner that is there, so that neighbours have the same bits.
    const auto at = [this](std::int64_t place, std::uint32_t sample, std::uint32_t count) {
      if (sample + 1 == count) return static_cast<double>(place + 1) * ground_.edge;
      return static_cast<double>(place) * ground_.edge + sample * (ground_.edge / (count - 1));
    };
    Tile tile;
    for (std::uint32_t row = 0; row < rows; ++row) {
      for (std::uint32_t column = 0; column < columns; ++column) {
        const double share = image->heights[std::size_t{rows - 1 - row} * columns + column];
        tile.vertices.emplace_back(at(file.place->first, column, columns), at(file.place->second, row, rows),
                                   ground_.low + share * (ground_.height - ground_.low));
      }
    }
    for (std::uint32_t row = 0; row + 1 < rows; ++row) {
      for (std::uint32_t column = 0; column + 1 < columns; ++column) {
        const std::uint32_t corner = row * columns + column;
        tile.triangles.push_back({corner, corner + 1, corner + columns});
        tile.triangles.push_back({corner + 1, corner + columns + 1, corner + columns});
      }
    }
    return tile;
  }

  Ground ground_;
  std::vector<File> files_;                                      // ascending by names
  std::optional<std::pair<std::uint32_t, std::uint32_t>> size_;  // of all images
};

}  // namespace

absl::StatusOr<std::unique_ptr<TileSource>> open_tile_folder(const Ground& ground) {
  absl::StatusOr<std::unique_ptr<TileFolder>> folder = TileFolder::open(ground);
  if (!folder.ok()) return folder.status();
  if (ground.checksum != 0 && ground.checksum != (*folder)->checksum()) {
    return absl::FailedPreconditionError(
        absl::StrCat("ground: the tiles in ", ground.folder, " are others than those of the world"));
  }
  return *std::move(folder);
}

absl::StatusOr<Ground> described_folder(Ground ground) {
  const absl::StatusOr<std::unique_ptr<TileFolder>> folder = TileFolder::open(ground);
  if (!folder.ok()) return folder.status();
  ground.checksum = (*folder)->checksum();
  if ((*folder)->spacing() > 0) ground.spacing = (*folder)->spacing();
  return ground;
}

void use_tile_folders(TileStore& store) { store.set_opener(open_tile_folder); }

}  // namespace tessera
