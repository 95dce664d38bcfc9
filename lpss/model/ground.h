// Ground of any extent, as a descriptor: what makes it, tile by tile, where something is near.
#pragma once

#include <cstdint>
#include <string>

namespace tessera {

// Part of a static body. The triangles are known only near what lives (lpss/ground); they depend on nothing
// but these values, and are the same bits on every processor.
struct Ground {
  enum class Source : std::uint8_t {
    kPlain,   // hills over the xy plane, out to kGroundReach
    kPlanet,  // hills over a ball around the origin
    kFolder,  // tiles in files
  };
  Source source = Source::kPlain;

  // --- kPlain, kPlanet: value noise ---
  double spacing = 8;        // m, between neighbouring vertices, at most
  double radius = 0;         // m, of a planet, to sea level
  double height = 0;         // m, which no summit exceeds, and no valley the depth
  double wavelength = 1000;  // m, of the broadest hills
  // Each one has half the wavelength and half the height of the one before.
  std::uint32_t octaves = 1;
  std::uint64_t seed = 0;
  bool has_sea = false;  // what would lie below 0 is flat, at 0

  // --- kFolder, whose `spacing` is that of its samples, `height` that of white ---
  std::string folder;
  double edge = 0;             // m, of a tile of heights
  double low = 0;              // m, of black
  std::uint64_t checksum = 0;  // of the index of the folder, which has those of all tiles

  friend bool operator==(const Ground&, const Ground&) = default;
};

}  // namespace tessera
