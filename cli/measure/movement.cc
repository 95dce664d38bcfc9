#include "cli/measure/movement.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <typename Number>
double step_at(double coordinate) {
  const auto number = static_cast<Number>(std::abs(coordinate));
  return static_cast<double>(std::nextafter(number, std::numeric_limits<Number>::infinity()) - number);
}

}  // namespace

void Movement::set_end(const BodyRecord& record) {
  if (record.properties.motion != Motion::kDynamic) return;
  if (record.id.value == 0 || record.id.value > start_.size()) return;
  const BodyRecord& start = start_[record.id.value - 1];
  const Eigen::Vector3d begin(start.state.position.data());
  const Eigen::Vector3d end(record.state.position.data());
  const double way = (metres_between(start.home, record.home, sector_size_) + (end - begin)).norm();
  ++report_.bodies;
  if (!(way < kMovedMin)) ++report_.moved;
  report_.coordinate_max =
      end.allFinite() ? std::max(report_.coordinate_max, end.cwiseAbs().maxCoeff()) : kInfinity;
}

MovementReport Movement::report() const {
  MovementReport report = report_;
  const double at = report.coordinate_max;
  report.coordinate_step = !std::isfinite(at)                  ? kInfinity
                           : precision_ == Precision::kFloat32 ? step_at<float>(at)
                                                               : step_at<double>(at);
  return report;
}

}  // namespace tessera
