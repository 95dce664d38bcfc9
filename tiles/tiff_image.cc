#include "tiles/tiff_image.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "lpss/model/limits.h"

namespace tessera {
namespace {

constexpr tmsize_t kAllocationMax = tmsize_t{1} << 30;  // bytes, of libtiff at once

// The bytes of a file as libtiff wants them.
struct Source {
  absl::string_view bytes;
  std::size_t place = 0;
  std::string error;
};

tmsize_t read(thandle_t handle, void* to, tmsize_t count) {
  auto& source = *static_cast<Source*>(handle);
  const std::size_t left = source.bytes.size() - std::min(source.place, source.bytes.size());
  const std::size_t taken = std::min(left, static_cast<std::size_t>(std::max<tmsize_t>(count, 0)));
  if (taken > 0) std::memcpy(to, source.bytes.data() + source.place, taken);
  source.place += taken;
  return static_cast<tmsize_t>(taken);
}
tmsize_t write_nothing(thandle_t, void*, tmsize_t) { return 0; }
toff_t seek(thandle_t handle, toff_t offset, int from) {
  auto& source = *static_cast<Source*>(handle);
  const std::size_t begin = from == SEEK_CUR ? source.place : from == SEEK_END ? source.bytes.size() : 0;
  source.place = begin + offset;
  return source.place;
}
int close(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<Source*>(handle)->bytes.size(); }

__attribute__((format(printf, 4, 0))) int keep_error(TIFF*, void* user, const char*, const char* format,
                                                     va_list arguments) {
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  if (auto& source = *static_cast<Source*>(user); source.error.empty()) source.error = text;
  return 1;
}
__attribute__((format(printf, 4, 0))) int ignore(TIFF*, void*, const char*, const char*, va_list) {
  return 1;
}

class Image {
 public:
  explicit Image(absl::string_view file) : source_{file, 0, ""} {
    TIFFOpenOptions* const options = TIFFOpenOptionsAlloc();
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, kAllocationMax);
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, &source_);
    TIFFOpenOptionsSetWarningHandlerExtR(options, ignore, nullptr);
    // Not mapped into memory; only the first image is read.
    tiff_ = TIFFClientOpenExt("heights", "rm", &source_, read, write_nothing, seek, close, size_of, nullptr,
                              nullptr, options);
    TIFFOpenOptionsFree(options);
  }
  ~Image() {
    if (tiff_ != nullptr) TIFFClose(tiff_);
  }
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;

  absl::StatusOr<HeightImage> heights() {
    if (tiff_ == nullptr) return failure();
    if (absl::Status status = read_layout(); !status.ok()) return status;
    image_.heights.assign(std::size_t{image_.columns} * image_.rows, 0);
    if (!(TIFFIsTiled(tiff_) ? read_tiles() : read_rows())) return failure();
    return scaled();
  }

 private:
  absl::Status failure() const {
    return absl::InvalidArgumentError(source_.error.empty() ? "its pixels cannot be read" : source_.error);
  }

  absl::Status read_layout() {
    TIFFGetField(tiff_, TIFFTAG_IMAGEWIDTH, &image_.columns);
    TIFFGetField(tiff_, TIFFTAG_IMAGELENGTH, &image_.rows);
    const std::uint64_t pixels = std::uint64_t{image_.columns} * image_.rows;
    if (image_.columns < 2 || image_.rows < 2 || pixels > kHeightFieldSamplesMax) {
      return absl::InvalidArgumentError(absl::StrCat(image_.columns, " x ", image_.rows,
                                                     " pixels must be at least 2 x 2 and at most ",
                                                     kHeightFieldSamplesMax));
    }
    std::uint16_t planes = PLANARCONFIG_CONTIG;
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_BITSPERSAMPLE, &bits_);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_SAMPLEFORMAT, &format_);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_SAMPLESPERPIXEL, &samples_);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_PLANARCONFIG, &planes);
    TIFFGetField(tiff_, TIFFTAG_PHOTOMETRIC, &photometric_);
    if (planes == PLANARCONFIG_SEPARATE) samples_ = 1;
    const bool is_number = format_ == SAMPLEFORMAT_UINT ? bits_ == 8 || bits_ == 16
                           : format_ == SAMPLEFORMAT_INT
                               ? bits_ == 8 || bits_ == 16 || bits_ == 32
                               : format_ == SAMPLEFORMAT_IEEEFP && (bits_ == 32 || bits_ == 64);
    if (!is_number || samples_ == 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          bits_, " bits of a sample must be 8 or 16, or 8 to 32 with a sign, or a floating point number"));
    }
    return absl::OkStatus();
  }

  template <typename T>
  static double as(const std::uint8_t* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  }

  double number(const std::uint8_t* bytes) const {
    if (format_ == SAMPLEFORMAT_IEEEFP) return bits_ == 32 ? as<float>(bytes) : as<double>(bytes);
    if (format_ == SAMPLEFORMAT_UINT) return bits_ == 8 ? as<std::uint8_t>(bytes) : as<std::uint16_t>(bytes);
    if (bits_ == 32) return as<std::int32_t>(bytes);
    return bits_ == 16 ? as<std::int16_t>(bytes) : as<std::int8_t>(bytes);
  }

  // `count` pixels from a row of the decoded image.
  void take(const std::uint8_t* pixels, std::uint32_t row, std::uint32_t column, std::uint32_t count) {
    const std::size_t step = std::size_t{samples_} * bits_ / 8;
    double* to = &image_.heights[std::size_t{row} * image_.columns + column];
    for (std::uint32_t n = 0; n < count; ++n, pixels += step) *to++ = number(pixels);
  }

  bool read_rows() {
    const tmsize_t size = TIFFScanlineSize(tiff_);
    if (size > kAllocationMax) return false;
    if (size < static_cast<tmsize_t>(std::size_t{image_.columns} * samples_ * bits_ / 8)) return false;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(size));
    for (std::uint32_t row = 0; row < image_.rows; ++row) {
      if (TIFFReadScanline(tiff_, pixels.data(), row, 0) != 1) return false;
      take(pixels.data(), row, 0, image_.columns);
    }
    return true;
  }

  bool read_tiles() {
    std::uint32_t width = 0;
    std::uint32_t length = 0;
    TIFFGetField(tiff_, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &length);
    const tmsize_t size = TIFFTileSize(tiff_);
    const tmsize_t row_size = TIFFTileRowSize(tiff_);
    if (width == 0 || length == 0 || size <= 0 || size > kAllocationMax) return false;
    if (row_size < static_cast<tmsize_t>(std::size_t{width} * samples_ * bits_ / 8)) return false;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(size));
    for (std::uint64_t row = 0; row < image_.rows; row += length) {
      for (std::uint64_t column = 0; column < image_.columns; column += width) {
        if (TIFFReadTile(tiff_, pixels.data(), static_cast<std::uint32_t>(column),
                         static_cast<std::uint32_t>(row), 0, 0) < 0)
          return false;
        const auto count =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(width, image_.columns - column));
        for (std::uint64_t n = 0; n < length && row + n < image_.rows; ++n)
          take(&pixels[n * static_cast<std::size_t>(row_size)], static_cast<std::uint32_t>(row + n),
               static_cast<std::uint32_t>(column), count);
      }
    }
    return true;
  }

  absl::StatusOr<HeightImage> scaled() {
    if (!std::ranges::all_of(image_.heights, [](double height) { return std::isfinite(height); }))
      return absl::InvalidArgumentError("all heights must be finite");
    const bool is_image = format_ == SAMPLEFORMAT_UINT;
    const double white = is_image ? (bits_ == 8 ? 0xff : 0xffff) : std::ranges::max(image_.heights);
    if (!(white > 0)) return absl::InvalidArgumentError("the largest height must be above 0");
    const bool is_inverse = is_image && photometric_ == PHOTOMETRIC_MINISWHITE;
    for (double& height : image_.heights) height = is_inverse ? (white - height) / white : height / white;
    return std::move(image_);
  }

  Source source_;
  TIFF* tiff_ = nullptr;
  HeightImage image_;
  std::uint16_t bits_ = 1;
  std::uint16_t format_ = SAMPLEFORMAT_UINT;
  std::uint16_t samples_ = 1;
  std::uint16_t photometric_ = PHOTOMETRIC_MINISBLACK;
};

}  // namespace

bool is_tiff(absl::string_view file) {
  for (const absl::string_view magic : {absl::string_view("II*\0", 4), absl::string_view("MM\0*", 4),
                                        absl::string_view("II+\0", 4), absl::string_view("MM\0+", 4)}) {
    if (absl::StartsWith(file, magic)) return true;
  }
  return false;
}

absl::StatusOr<HeightImage> decoded_tiff(absl::string_view file) { return Image(file).heights(); }

}  // namespace tessera
