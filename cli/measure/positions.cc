#include "cli/measure/positions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

Positions positions_from(const WorldPosition& origin, const std::vector<BodyRecord>& records,
                         double sector_size) {
  Positions positions;
  for (const BodyRecord& record : records) {
    const Eigen::Map<const Eigen::Vector3d> local(record.state.position.data());
    positions.push_back(metres_between(origin.sector, record.home, sector_size) + (local - origin.local));
  }
  return positions;
}

double largest_distance(const Positions& a, const Positions& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const double distance = (a[i] - b[i]).norm();
    if (!std::isfinite(distance)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, distance);
  }
  return largest;
}

}  // namespace tessera
