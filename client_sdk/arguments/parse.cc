#include "client_sdk/arguments/parse.h"

#include <absl/numeric/int128.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>
#include <absl/time/time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace tessera {
namespace {

constexpr std::size_t kDigitsMax = 20;  // of any number that could fit in 64 bits

absl::Status out_of_range(absl::string_view text) {
  return absl::OutOfRangeError(absl::StrCat("\"", text, "\" is outside the 64-bit range, -2^63 to 2^63 - 1"));
}

absl::StatusOr<std::array<std::int64_t, 3>> parse_integers(absl::string_view text) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  if (parts.size() != 3) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not three whole numbers I,J,K"));
  }
  std::array<std::int64_t, 3> numbers{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const absl::StatusOr<std::int64_t> number = parse_integer(parts[axis]);
    if (!number.ok()) return number.status();
    numbers[axis] = *number;
  }
  return numbers;
}

absl::StatusOr<std::vector<double>> parse_doubles(absl::string_view text) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0;
    if (!absl::SimpleAtod(part, &number) || !std::isfinite(number)) {
      return absl::InvalidArgumentError(absl::StrCat("\"", part, "\" is not a finite number"));
    }
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<std::int64_t> parse_integer(absl::string_view text) {
  absl::string_view digits = absl::StripAsciiWhitespace(text);
  const bool negative = absl::ConsumePrefix(&digits, "-");
  if (!negative) absl::ConsumePrefix(&digits, "+");
  const bool power = absl::ConsumePrefix(&digits, "2^");
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (digits.empty() || !std::all_of(digits.begin(), digits.end(), is_digit)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not a whole number such as 12, -7, 2^40 or -2^62"));
  }
  while (digits.size() > 1 && digits.front() == '0') digits.remove_prefix(1);
  if (digits.size() > kDigitsMax) return out_of_range(text);

  absl::int128 magnitude = 0;
  for (const char c : digits) magnitude = magnitude * 10 + (c - '0');
  if (power) {
    if (magnitude > 63) return out_of_range(text);
    magnitude = absl::int128(1) << static_cast<int>(magnitude);
  }
  const absl::int128 value = negative ? -magnitude : magnitude;
  if (value < std::numeric_limits<std::int64_t>::min() || value > std::numeric_limits<std::int64_t>::max()) {
    return out_of_range(text);
  }
  return static_cast<std::int64_t>(value);
}

absl::StatusOr<SectorOffset> parse_shift(absl::string_view text) {
  const auto numbers = parse_integers(text);
  if (!numbers.ok()) return numbers.status();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t number = (*numbers)[axis];
    if (number > kShiftMax || number < -kShiftMax) {
      return absl::OutOfRangeError(absl::StrCat("component ", std::string(1, "IJK"[axis]), " of \"", text,
                                                "\" is beyond 2^62 = ", kShiftMax, " sectors"));
    }
  }
  return SectorOffset{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

absl::StatusOr<SectorIndex> parse_sector(absl::string_view text) {
  std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  FrameNumber frame = kWorldFrame;
  if (parts.size() == 4) {
    if (!absl::SimpleAtoi(parts.back(), &frame))
      return absl::InvalidArgumentError(absl::StrCat("\"", parts.back(), "\" is not the number of a frame"));
    parts.pop_back();
  }
  const auto numbers = parse_integers(absl::StrJoin(parts, ","));
  if (!numbers.ok()) return numbers.status();
  return SectorIndex{(*numbers)[0], (*numbers)[1], (*numbers)[2], frame};
}

absl::StatusOr<Eigen::Vector3d> parse_vector(absl::string_view text) {
  const absl::StatusOr<std::vector<double>> numbers = parse_doubles(text);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != 3) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not three numbers X,Y,Z"));
  }
  return Eigen::Vector3d(numbers->data());
}

absl::StatusOr<Shape> parse_shape(absl::string_view text) {
  const std::pair<absl::string_view, absl::string_view> halves =
      absl::StrSplit(text, absl::MaxSplits(':', 1));
  const absl::StatusOr<std::vector<double>> numbers = parse_doubles(halves.second);
  const std::size_t count = numbers.ok() ? numbers->size() : 0;
  const absl::string_view kind = halves.first;
  Geometry geometry;
  if (kind == "box" && count == 3) {
    geometry = Box{Eigen::Vector3d(numbers->data())};
  } else if (kind == "sphere" && count == 1) {
    geometry = Sphere{(*numbers)[0]};
  } else if (kind == "capsule" && count == 2) {
    geometry = Capsule{(*numbers)[0], (*numbers)[1]};
  } else if (kind == "cylinder" && count == 2) {
    geometry = Cylinder{(*numbers)[0], (*numbers)[1]};
  } else if (kind == "ellipsoid" && count == 3) {
    geometry = Ellipsoid{Eigen::Vector3d(numbers->data())};
  } else if (kind == "plane" && count == 3) {
    geometry = Plane{Eigen::Vector3d(numbers->data()).normalized()};
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text,
                     "\" is not a shape such as box:1,1,1 sphere:0.5 capsule:0.5,1 cylinder:0.5,1 "
                     "ellipsoid:0.5,0.4,0.3 plane:0,0,1"));
  }
  return Shape{{ShapePart{std::move(geometry), Pose{}}}};
}

absl::StatusOr<double> parse_length(absl::string_view text) {
  constexpr std::pair<absl::string_view, double> kUnits[] = {
      {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}};
  absl::string_view number = text;
  double unit = 1;
  for (const auto& [suffix, metres] : kUnits) {
    if (!absl::ConsumeSuffix(&number, suffix)) continue;
    unit = metres;
    break;
  }
  double value = 0;
  if (absl::SimpleAtod(number, &value) && std::isfinite(value) && value > 0) return value * unit;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is no length above 0, such as 1mm or 0.5m"));
}

absl::StatusOr<double> parse_seconds(absl::string_view text) {
  double value = 0;
  absl::Duration duration;
  if (!absl::SimpleAtod(text, &value) && absl::ParseDuration(text, &duration))
    value = absl::ToDoubleSeconds(duration);
  if (std::isfinite(value) && value > 0) return value;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is no time above 0, such as 2s or 500ms"));
}

}  // namespace tessera
