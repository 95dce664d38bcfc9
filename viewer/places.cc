#include "viewer/places.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace tessera::viewer {
namespace {

using Sectors = absl::flat_hash_map<SectorIndex, std::vector<const BodySample*>>;

// Removes the sector and all sectors connected to it from `sectors`.
std::vector<std::pair<SectorIndex, std::vector<const BodySample*>>> take_cluster(Sectors& sectors) {
  std::vector<std::pair<SectorIndex, std::vector<const BodySample*>>> cluster;
  cluster.emplace_back(*sectors.begin());
  sectors.erase(sectors.begin());
  for (std::size_t next = 0; next < cluster.size(); ++next) {
    const SectorIndex from = cluster[next].first;
    for (int place = 0; place < 27; ++place) {
      const absl::StatusOr<SectorIndex> neighbour =
          translated(from, {place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1});
      if (!neighbour.ok()) continue;
      const auto found = sectors.find(*neighbour);
      if (found == sectors.end()) continue;
      cluster.emplace_back(*found);
      sectors.erase(found);
    }
  }
  return cluster;
}

}  // namespace

std::vector<Place> places_of(const std::vector<BodySample>& bodies, double sector_size) {
  Sectors sectors;
  for (const BodySample& body : bodies) sectors[body.pose.position.sector].push_back(&body);
  std::vector<Place> places;
  while (!sectors.empty()) {
    const auto cluster = take_cluster(sectors);
    const SectorIndex& origin = cluster.front().first;
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Eigen::Vector3d low = Eigen::Vector3d::Constant(kFar);
    Eigen::Vector3d high = Eigen::Vector3d::Constant(-kFar);
    Place place;
    place.sectors = cluster.size();
    place.first = cluster.front().second.front()->id;
    for (const auto& [sector, inhabitants] : cluster) {
      place.bodies += inhabitants.size();
      for (const BodySample* body : inhabitants) {
        const Eigen::Vector3d point = relative_to(body->pose.position, origin, sector_size);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
        place.first = std::min(place.first, body->id);
      }
    }
    place.half = (high - low).maxCoeff() / 2;
    const absl::StatusOr<WorldPosition> centre = canonical(origin, (low + high) / 2, sector_size);
    place.centre = centre.ok() ? *centre : WorldPosition{origin, {0, 0, 0}};
    places.push_back(place);
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::pair(b.bodies, a.first) < std::pair(a.bodies, b.first);
  });
  return places;
}

}  // namespace tessera::viewer
