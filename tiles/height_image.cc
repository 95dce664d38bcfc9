#include "tiles/height_image.h"

#include <absl/strings/str_cat.h>
#include <png.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "lpss/model/limits.h"
#include "tiles/tiff_image.h"

namespace tessera {
namespace {

// libpng must not return from an error; C++ objects on the way are destroyed.
[[noreturn]] void fail(png_structp, png_const_charp message) { throw std::runtime_error(message); }
void ignore(png_structp, png_const_charp) {}

class Decoder {
 public:
  Decoder() : png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, ignore)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ == nullptr) throw std::runtime_error("out of memory");
  }
  ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  HeightImage read_size(absl::string_view file) {
    left_ = file;
    png_set_read_fn(png_, this, take);
    png_set_user_limits(png_, kHeightFieldSamplesMax, kHeightFieldSamplesMax);
    png_read_info(png_, info_);
    HeightImage image;
    image.columns = png_get_image_width(png_, info_);
    image.rows = png_get_image_height(png_, info_);
    const std::uint64_t pixels = std::uint64_t{image.columns} * image.rows;
    if (image.columns < 2 || image.rows < 2 || pixels > kHeightFieldSamplesMax) {
      throw std::runtime_error(absl::StrCat(image.columns, " x ", image.rows,
                                            " pixels must be at least 2 x 2 and at most ",
                                            kHeightFieldSamplesMax));
    }
    return image;
  }

  HeightImage read(absl::string_view file) {
    HeightImage image = read_size(file);
    png_set_expand(png_);  // palettes, and grey of less than 8 bits
    const int passes = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    const std::size_t bytes = png_get_rowbytes(png_, info_);
    pixels_.resize(bytes * image.rows);
    std::vector<png_bytep> rows(image.rows);
    for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = &pixels_[row * bytes];
    for (int pass = 0; pass < passes; ++pass) png_read_rows(png_, rows.data(), nullptr, image.rows);
    const bool is_wide = png_get_bit_depth(png_, info_) == 16;
    const std::size_t step = std::size_t{png_get_channels(png_, info_)} * (is_wide ? 2 : 1);
    image.heights.reserve(std::size_t{image.columns} * image.rows);
    for (png_bytep row : rows) {
      for (std::uint32_t column = 0; column < image.columns; ++column, row += step)
        image.heights.push_back(is_wide ? (row[0] * 256 + row[1]) / 65535.0 : row[0] / 255.0);
    }
    return image;
  }

 private:
  static void take(png_structp png, png_bytep to, std::size_t count) {
    absl::string_view& left = static_cast<Decoder*>(png_get_io_ptr(png))->left_;
    if (left.size() < count) throw std::runtime_error("it ends too early");
    std::memcpy(to, left.data(), count);
    left.remove_prefix(count);
  }

  absl::string_view left_;  // of the file's bytes
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::vector<png_byte> pixels_;
};

}  // namespace

absl::StatusOr<HeightImage> decoded_image(absl::string_view file) {
  try {
    return Decoder().read(file);
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("it must be a PNG image: ", error.what()));
  }
}

absl::StatusOr<std::pair<std::uint32_t, std::uint32_t>> size_of_image(absl::string_view file) {
  try {
    const HeightImage image = Decoder().read_size(file);
    return std::pair(image.columns, image.rows);
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("it must be a PNG image: ", error.what()));
  }
}

absl::StatusOr<HeightImage> read_height_image(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return absl::NotFoundError(absl::StrCat("height map ", file.string(), ": cannot be opened"));
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  absl::StatusOr<HeightImage> image = is_tiff(bytes) ? decoded_tiff(bytes) : decoded_image(bytes);
  if (image.ok()) return image;
  return absl::Status(image.status().code(),
                      absl::StrCat("height map ", file.string(), ": ", image.status().message()));
}

}  // namespace tessera
