#include "cli/measure/towers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "lpss/model/felt.h"

namespace tessera {
namespace {

constexpr std::string_view kPrefix = "tower";
constexpr std::string_view kSeparator = "::";

// The name up to the end of the first model in it that is a tower; the last part, a link, is none.
std::optional<std::string> tower_of(std::string_view name) {
  std::size_t begin = 0;
  for (std::size_t end = name.find(kSeparator); end != std::string_view::npos;
       end = name.find(kSeparator, begin)) {
    if (name.substr(begin, end - begin).starts_with(kPrefix)) return std::string(name.substr(0, end));
    begin = end + kSeparator.size();
  }
  return std::nullopt;
}

Eigen::Vector3d local(const BodyRecord& record) { return Eigen::Vector3d(record.state.position.data()); }

// m/s^2, along the axes of the frame that the body is in.
Eigen::Vector3d felt_at_start(const WorldSettings& settings, const BodyRecord& record) {
  const Felt felt(settings, record.home.frame, 0, carried_at_start(settings));
  return felt.at(record.home, local(record), /*has_gravity=*/true);
}

}  // namespace

Towers::Towers(const WorldDescription& world, const std::vector<BodyRecord>& start)
    : sector_size_(world.settings.sector_size) {
  std::map<std::string, std::vector<const BodyRecord*>> found;
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (start[i].properties.motion != Motion::kDynamic) continue;
    if (const std::optional<std::string> name = tower_of(world.bodies[i].name))
      found[*name].push_back(&start[i]);
  }
  for (const auto& [name, records] : found) {
    if (records.size() < 2) continue;
    const BodyRecord& first = *records.front();
    const Eigen::Vector3d down = felt_at_start(world.settings, first);
    Tower tower;
    double highest = -std::numeric_limits<double>::infinity();
    for (const BodyRecord* record : records) {
      const Eigen::Vector3d from_first =
          metres_between(first.home, record->home, sector_size_) + local(*record);
      const double height = -from_first.dot(down);
      if (height > highest) {
        highest = height;
        tower.top = record->id;
      }
      tower.blocks.push_back(record->id);
      blocks_[record->id] = {record->home, local(*record), std::numeric_limits<double>::infinity()};
    }
    towers_.push_back(std::move(tower));
  }
}

void Towers::set_end(const BodyRecord& record) {
  const auto block = blocks_.find(record.id);
  if (block == blocks_.end()) return;
  const Eigen::Vector3d way = metres_between(block->second.home, record.home, sector_size_) +
                              (local(record) - block->second.position);
  const double displacement = way.norm();
  block->second.displacement =
      std::isfinite(displacement) ? displacement : std::numeric_limits<double>::infinity();
}

TowerReport Towers::report() const {
  TowerReport report;
  report.towers = towers_.size();
  for (const Tower& tower : towers_) {
    if (blocks_.at(tower.top).displacement < kStandingDisplacementMax) ++report.standing;
  }
  std::vector<double> displacements;
  for (const auto& [id, block] : blocks_) displacements.push_back(block.displacement);
  if (displacements.empty()) return report;
  std::sort(displacements.begin(), displacements.end());
  report.displacement_median = displacements[displacements.size() / 2];
  report.displacement_max = displacements.back();
  return report;
}

}  // namespace tessera
