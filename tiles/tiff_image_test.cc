// Heights from TIFF files: what tools for images and for maps write.
#include "tiles/tiff_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// An image, and how it is written; gone after the test.
class Written {
 public:
  explicit Written(std::uint16_t format, std::uint16_t photometric = PHOTOMETRIC_MINISBLACK,
                   bool tiled = false)
      : file_(std::filesystem::path(testing::TempDir()) / ("tessera_" + std::to_string(getpid()) + ".tif")),
        format_(format),
        photometric_(photometric),
        tiled_(tiled) {}
  ~Written() { std::filesystem::remove(file_); }
  Written(const Written&) = delete;
  Written& operator=(const Written&) = delete;

  template <typename T>
  const std::filesystem::path& write(std::uint32_t columns, std::uint32_t rows,
                                     const std::vector<T>& pixels) {
    constexpr std::uint32_t kTile = 16;
    TIFF* const tiff = TIFFOpen(file_.c_str(), "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, columns);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, rows);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(T)));
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, static_cast<int>(format_));
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, static_cast<int>(photometric_));
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    if (tiled_) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kTile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, kTile);
      for (std::uint32_t row = 0; row < rows; row += kTile) {
        for (std::uint32_t column = 0; column < columns; column += kTile) {
          std::vector<T> tile(kTile * kTile);
          for (std::uint32_t r = 0; r < kTile && row + r < rows; ++r) {
            for (std::uint32_t c = 0; c < kTile && column + c < columns; ++c)
              tile[r * kTile + c] = pixels[(row + r) * columns + column + c];
          }
          TIFFWriteTile(tiff, tile.data(), column, row, 0, 0);
        }
      }
    } else {
      for (std::uint32_t row = 0; row < rows; ++row)
        TIFFWriteScanline(tiff, const_cast<T*>(&pixels[row * columns]), row, 0);
    }
    TIFFClose(tiff);
    return file_;
  }

  std::string bytes() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

 private:
  std::filesystem::path file_;
  std::uint16_t format_;
  std::uint16_t photometric_;
  bool tiled_;
};

std::vector<double> heights_of(const std::filesystem::path& file) {
  const absl::StatusOr<HeightImage> image = read_height_image(file);
  EXPECT_TRUE(image.ok()) << image.status();
  return image.ok() ? image->heights : std::vector<double>{};
}

TEST(TiffImage, ImagesReachFromBlackToWhite) {
  Written bytes(SAMPLEFORMAT_UINT);
  EXPECT_THAT(heights_of(bytes.write<std::uint8_t>(3, 2, {0, 51, 102, 153, 204, 204})),
              ElementsAre(0, 0.2, 0.4, 0.6, 0.8, 0.8));
  Written words(SAMPLEFORMAT_UINT);
  EXPECT_THAT(heights_of(words.write<std::uint16_t>(2, 2, {0, 13107, 26214, 65535})),
              ElementsAre(0, 0.2, 0.4, 1));
  Written inverse(SAMPLEFORMAT_UINT, PHOTOMETRIC_MINISWHITE);
  EXPECT_THAT(heights_of(inverse.write<std::uint8_t>(2, 2, {0, 51, 204, 255})), ElementsAre(1, 0.8, 0.2, 0));
}

TEST(TiffImage, MapsAreSharesOfTheirLargestHeight) {
  Written floats(SAMPLEFORMAT_IEEEFP);
  EXPECT_THAT(heights_of(floats.write<float>(2, 2, {-100, 0, 400, 800})), ElementsAre(-0.125, 0, 0.5, 1));
  Written doubles(SAMPLEFORMAT_IEEEFP);
  EXPECT_THAT(heights_of(doubles.write<double>(2, 2, {1, 2, 4, 8})), ElementsAre(0.125, 0.25, 0.5, 1));
  Written words(SAMPLEFORMAT_INT);
  EXPECT_THAT(heights_of(words.write<std::int16_t>(2, 2, {-1000, 0, 1000, 2000})),
              ElementsAre(-0.5, 0, 0.5, 1));
}

TEST(TiffImage, TilesAreRows) {
  constexpr std::uint32_t kColumns = 40;
  constexpr std::uint32_t kRows = 23;
  std::vector<float> pixels;
  for (std::uint32_t n = 0; n < kColumns * kRows; ++n) pixels.push_back(static_cast<float>(n + 1));
  Written tiled(SAMPLEFORMAT_IEEEFP, PHOTOMETRIC_MINISBLACK, true);
  const std::vector<double> heights = heights_of(tiled.write(kColumns, kRows, pixels));
  ASSERT_EQ(heights.size(), pixels.size());
  for (std::size_t n = 0; n < heights.size(); ++n)
    EXPECT_EQ(heights[n], static_cast<double>(n + 1) / (kColumns * kRows)) << n;
}

TEST(TiffImage, WhatIsNoneIsRefused) {
  const auto error = [](absl::string_view bytes) {
    return std::string(decoded_tiff(bytes).status().message());
  };
  EXPECT_FALSE(is_tiff("no image"));
  EXPECT_TRUE(is_tiff(absl::string_view("II*\0", 4)));
  EXPECT_NE(error(absl::string_view("II*\0", 4)), "");
  Written line(SAMPLEFORMAT_UINT);
  line.write<std::uint8_t>(3, 1, {1, 2, 3});
  EXPECT_THAT(error(line.bytes()), HasSubstr("3 x 1 pixels must be at least 2 x 2"));
  Written low(SAMPLEFORMAT_IEEEFP);
  low.write<float>(2, 2, {-1, -2, -3, 0});
  EXPECT_THAT(error(low.bytes()), HasSubstr("the largest height must be above 0"));
  Written hole(SAMPLEFORMAT_IEEEFP);
  hole.write<float>(2, 2, {1, 2, std::numeric_limits<float>::quiet_NaN(), 4});
  EXPECT_THAT(error(hole.bytes()), HasSubstr("must be finite"));
  Written wide(SAMPLEFORMAT_UINT);
  wide.write<std::uint32_t>(2, 2, {1, 2, 3, 4});
  EXPECT_THAT(error(wide.bytes()), HasSubstr("32 bits of a sample must be 8 or 16"));
  Written whole(SAMPLEFORMAT_UINT);
  whole.write<std::uint8_t>(30, 30, std::vector<std::uint8_t>(900, 7));
  const std::string bytes = whole.bytes();
  for (std::size_t length = 0; length < bytes.size() / 2; ++length)
    EXPECT_FALSE(decoded_tiff(absl::string_view(bytes).substr(0, length)).ok()) << length;
}

}  // namespace
}  // namespace tessera
