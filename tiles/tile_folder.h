// Ground from a folder of files, a tile each.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <memory>

#include "lpss/ground/tile_store.h"

namespace tessera {

inline constexpr std::size_t kTileFilesMax = 100'000;
inline constexpr std::uintmax_t kTileFileBytesMax = std::uintmax_t{256} << 20;

// The files of a folder whose names end in
//
//   I_J.png   heights of 8 or 16 bits from `low` (black) to `height` (white), seen from above with x to the
//   right and
//             y upwards. I and J are integers: the tile covers I to I + 1 times `edge` in x, and so on.
//             Neighbours share the pixels of their border. All images are of one size.
//   .obj      triangles in the frame of the ground, counter-clockwise from above: any surface, such as a
//   planet's.
//
// are its tiles; others are ignored. All are read once here, for where they are and for their checksum, and
// then each when it is needed: one that has changed is an error then.
//
// NOT_FOUND without such a folder or any tile in it; INVALID_ARGUMENT for a file that is none, with its name;
// FAILED_PRECONDITION if `ground.checksum` is neither 0 nor the folder's.
absl::StatusOr<std::unique_ptr<TileSource>> open_tile_folder(const Ground& ground);

// The ground again, with the checksum of the folder and the least distance of samples (kFolder: `spacing`),
// as its world has it. Errors: as open_tile_folder().
absl::StatusOr<Ground> described_folder(Ground ground);

// Lets a store read them.
void use_tile_folders(TileStore& store = TileStore::of_process());

}  // namespace tessera
