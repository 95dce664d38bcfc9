#include "proto/packed_bodies.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "proto/convert.h"

namespace tessera {
namespace {

using Numbers = PackedHistory::Numbers;

constexpr std::uint64_t kAsleep = 1;
constexpr std::uint64_t kGoesOn = 2;
constexpr std::uint64_t kTurnsOn = 4;
constexpr std::uint64_t kLargest = 8;  // times the place
constexpr std::uint64_t kHasVelocities = 32;
constexpr std::uint64_t kFlagsMax = 63;
constexpr double kTurnMax = 0.1;  // rad
// What is finite and in range is far below; what is expected, and differences, fit into 62 bits.
constexpr std::int64_t kNumberMax = std::int64_t{1} << 59;

void write(std::uint64_t number, std::string& bytes) {
  for (; number >= 128; number >>= 7) bytes.push_back(static_cast<char>(number | 128));
  bytes.push_back(static_cast<char>(number));
}

void write(const Numbers& numbers, std::string& bytes) {
  for (const std::int64_t number : numbers)
    write((static_cast<std::uint64_t>(number) << 1) ^ static_cast<std::uint64_t>(number >> 63), bytes);
}

Numbers difference(const Numbers& a, const Numbers& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Numbers in_quanta(const Eigen::Vector3d& v, double quantum) {
  Numbers numbers{};
  for (int axis = 0; axis < 3; ++axis) {
    const double number = std::isfinite(v[axis]) ? v[axis] / quantum : 0;
    constexpr auto kMax = static_cast<double>(kNumberMax);
    numbers[axis] = std::llround(std::clamp(number, -kMax, kMax));
  }
  return numbers;
}

Eigen::Vector3d of_quanta(const Numbers& numbers, double quantum) {
  return quantum * Eigen::Vector3d(static_cast<double>(numbers[0]), static_cast<double>(numbers[1]),
                                   static_cast<double>(numbers[2]));
}

int largest_of(const Eigen::Quaterniond& q) {
  int place = 0;
  q.coeffs().cwiseAbs().maxCoeff(&place);
  return place;
}

// The other components of q or -q, the one whose largest is positive.
Eigen::Vector3d smallest_three(const Eigen::Quaterniond& q, int largest) {
  const Eigen::Vector4d all = q.coeffs()[largest] < 0 ? Eigen::Vector4d(-q.coeffs()) : q.coeffs();
  Eigen::Vector3d three;
  for (int place = 0, n = 0; place < 4; ++place) {
    if (place != largest) three[n++] = all[place];
  }
  return three;
}

Eigen::Quaterniond with_largest(const Eigen::Vector3d& three, int largest) {
  Eigen::Vector4d all;
  for (int place = 0, n = 0; place < 4; ++place) all[place] = place == largest ? 0 : three[n++];
  all[largest] = std::sqrt(std::max(0.0, 1 - three.squaredNorm()));
  return Eigen::Quaterniond(all).normalized();
}

class Numbered {
 public:
  explicit Numbered(std::string_view bytes) : bytes_(bytes) {}

  bool at_end() const { return bytes_.empty(); }
  bool ok() const { return ok_; }

  std::uint64_t number() {
    std::uint64_t number = 0;
    for (int shift = 0; shift < 64 && !bytes_.empty(); shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes_.front());
      bytes_.remove_prefix(1);
      number |= std::uint64_t{byte & 127u} << shift;
      if (byte < 128) return number;
    }
    ok_ = false;
    return 0;
  }
  // Added to `from`.
  Numbers numbers(const Numbers& from = {}) {
    Numbers result{};
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint64_t zigzag = number();
      const auto more = static_cast<std::int64_t>((zigzag >> 1) ^ (~(zigzag & 1) + 1));
      ok_ = ok_ && std::abs(more / 4) <= kNumberMax;
      if (!ok_) return {};
      result[axis] = from[axis] + more;
      ok_ = std::abs(result[axis]) <= kNumberMax;
    }
    return ok_ ? result : Numbers{};
  }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace

absl::Status check(const PackedPrecision& precision) {
  const auto within = [](double value, double max) { return value >= kPrecisionMin && value <= max; };
  if (!within(precision.position, kPrecisionMax)) {
    return absl::InvalidArgumentError(absl::StrCat("precision: ", precision.position,
                                                   " m is neither 0 nor within ", kPrecisionMin, " to ",
                                                   kPrecisionMax));
  }
  if (precision.velocity == 0 || within(precision.velocity, kVelocityPrecisionMax)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("velocity_precision: ", precision.velocity,
                                                 " m/s is neither 0 nor within ", kPrecisionMin, " to ",
                                                 kVelocityPrecisionMax));
}

PackedHistory::PackedHistory(const PackedPrecision& precision)
    : quantum_(2 * precision.position / std::sqrt(3.0)),
      turn_(std::min(precision.position, kTurnMax) / 4),
      velocity_(2 * precision.velocity / std::sqrt(3.0)) {}

void BodyPacker::add(const BodyRow& body, v1::PackedBodies& packed) {
  std::string& bytes = *packed.mutable_bodies();
  const SectorIndex& sector = body.pose.position.sector;
  const int largest = largest_of(body.pose.orientation);
  const Numbers position = in_quanta(body.pose.position.local, quantum_);
  const Numbers orientation = in_quanta(smallest_three(body.pose.orientation, largest), turn_);
  const bool has_velocities =
      velocity_ > 0 && (!body.linear_velocity.isZero(0) || !body.angular_velocity.isZero(0));
  Last& last = last_[body.id];
  const bool goes_on = last.largest >= 0 && last.sector == sector;
  const bool turns_on = last.largest == largest;

  write(body.id.value - last_id_, bytes);
  last_id_ = body.id.value;
  write((body.asleep ? kAsleep : 0) + (goes_on ? kGoesOn : 0) + (turns_on ? kTurnsOn : 0) +
            kLargest * static_cast<std::uint64_t>(largest) + (has_velocities ? kHasVelocities : 0),
        bytes);
  if (goes_on) {
    write(difference(position, last.position.expected()), bytes);
    last.position.go_on(position);
  } else {
    const auto [place, is_new] = places_.try_emplace(sector, places_.size());
    if (is_new) *packed.add_sectors() = to_proto(sector);
    write(place->second, bytes);
    write(position, bytes);
    last.position.begin(position);
    last.sector = sector;
  }
  if (turns_on) {
    write(difference(orientation, last.orientation.expected()), bytes);
    last.orientation.go_on(orientation);
  } else {
    write(orientation, bytes);
    last.orientation.begin(orientation);
    last.largest = largest;
  }
  if (!has_velocities) return;
  write(in_quanta(body.linear_velocity, velocity_), bytes);
  write(in_quanta(body.angular_velocity, velocity_), bytes);
}

absl::Status BodyUnpacker::read(const v1::PackedBodies& packed,
                                const std::function<void(const BodyRow&)>& visit) {
  const auto corrupt = [] { return absl::DataLossError("packed bodies cannot be read"); };
  std::vector<SectorIndex> sectors;
  for (const v1::SectorIndex& sector : packed.sectors()) sectors.push_back(from_proto(sector));
  Numbered bytes(packed.bodies());
  BodyRow body;
  while (!bytes.at_end()) {
    const std::uint64_t more = bytes.number();
    const std::uint64_t flags = bytes.number();
    if (!bytes.ok() || more == 0 || flags > kFlagsMax) return corrupt();
    body.id.value += more;
    body.asleep = (flags & kAsleep) != 0;
    const int largest = static_cast<int>(flags / kLargest % 4);
    Last& last = last_[body.id];
    const bool goes_on = (flags & kGoesOn) != 0;
    const bool turns_on = (flags & kTurnsOn) != 0;
    if ((goes_on && last.largest < 0) || (turns_on && last.largest != largest)) return corrupt();

    Numbers position{};
    if (goes_on) {
      position = bytes.numbers(last.position.expected());
      last.position.go_on(position);
    } else {
      const std::uint64_t place = bytes.number();
      if (place >= sectors.size()) return corrupt();
      last.sector = sectors[place];
      position = bytes.numbers();
      last.position.begin(position);
    }
    Numbers orientation{};
    if (turns_on) {
      orientation = bytes.numbers(last.orientation.expected());
      last.orientation.go_on(orientation);
    } else {
      orientation = bytes.numbers();
      last.orientation.begin(orientation);
    }
    last.largest = largest;
    body.pose.position = {last.sector, of_quanta(position, quantum_)};
    body.pose.orientation = with_largest(of_quanta(orientation, turn_), largest);
    body.linear_velocity.setZero();
    body.angular_velocity.setZero();
    if ((flags & kHasVelocities) != 0) {
      body.linear_velocity = of_quanta(bytes.numbers(), velocity_);
      body.angular_velocity = of_quanta(bytes.numbers(), velocity_);
    }
    if (!bytes.ok()) return corrupt();
    visit(body);
  }
  return absl::OkStatus();
}

}  // namespace tessera
