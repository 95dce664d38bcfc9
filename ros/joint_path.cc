#include "ros/joint_path.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tessera::ros {
namespace {

constexpr double kNanosecond = 1e-9;

std::vector<double> numbers_of(const dds_sequence_double& sequence) {
  return {sequence._buffer, sequence._buffer + sequence._length};
}

bool are_finite(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

// Hermite's curve from a to b, at a part of the time between them (s).
double cubic(double a, double slope_a, double b, double slope_b, double between, double part) {
  const double rest = 1 - part;
  return a * (1 + 2 * part) * rest * rest + slope_a * between * part * rest * rest +
         b * part * part * (3 - 2 * part) - slope_b * between * part * part * rest;
}

}  // namespace

absl::StatusOr<JointPath> JointPath::from(const trajectory_msgs_msg_dds__JointTrajectory_& message) {
  const auto invalid = [](const auto&... text) { return absl::InvalidArgumentError(absl::StrCat(text...)); };
  JointPath path;
  std::set<std::string> names;
  for (std::uint32_t n = 0; n < message.joint_names._length; ++n) {
    path.joints_.emplace_back(message.joint_names._buffer[n]);
    if (!names.insert(path.joints_.back()).second)
      return invalid("joint_names: \"", path.joints_.back(), "\" comes twice");
  }
  if (path.joints_.empty()) return invalid("joint_names: there is none");
  const std::uint32_t count = message.points._length;
  if (count == 0 || count > kPathPointsMax)
    return invalid("points: ", count, " must be 1 to ", kPathPointsMax);
  for (std::uint32_t n = 0; n < count; ++n) {
    const trajectory_msgs_msg_dds__JointTrajectoryPoint_& from = message.points._buffer[n];
    Point point{from.time_from_start.sec + kNanosecond * from.time_from_start.nanosec,
                numbers_of(from.positions), numbers_of(from.velocities)};
    const std::string title = absl::StrCat("points[", n, "]");
    if (point.positions.size() != path.joints_.size())
      return invalid(title, ".positions: ", point.positions.size(), " must be one for each of the ",
                     path.joints_.size(), " joints");
    if (!point.velocities.empty() && point.velocities.size() != path.joints_.size())
      return invalid(title, ".velocities: ", point.velocities.size(),
                     " must be none, or one for each of the ", path.joints_.size(), " joints");
    if (!are_finite(point.positions) || !are_finite(point.velocities))
      return invalid(title, ": its numbers must be finite");
    const double before = n == 0 ? -kNanosecond : path.points_.back().time;
    if (!(point.time > before)) return invalid(title, ".time_from_start: must be after the point before it");
    path.points_.push_back(std::move(point));
  }
  return path;
}

void JointPath::begin_at(const std::vector<double>& positions) {
  if (points_.front().time > 0) points_.insert(points_.begin(), Point{0, positions, {}});
}

std::vector<double> JointPath::at(double seconds) const {
  const auto next = std::ranges::find_if(points_, [&](const Point& point) { return point.time > seconds; });
  if (next == points_.begin()) return points_.front().positions;
  if (next == points_.end()) return points_.back().positions;
  const Point& a = *(next - 1);
  const Point& b = *next;
  const double between = b.time - a.time;
  const double part = (seconds - a.time) / between;
  std::vector<double> positions;
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    positions.push_back(
        a.velocities.empty() || b.velocities.empty()
            ? a.positions[n] + part * (b.positions[n] - a.positions[n])
            : cubic(a.positions[n], a.velocities[n], b.positions[n], b.velocities[n], between, part));
  }
  return positions;
}

}  // namespace tessera::ros
