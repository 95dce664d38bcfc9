// One of several worlds that are stepped in turn, tick by tick, so that what else the machine does meets all
// of them.
#pragma once

#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/local_world.h"
#include "cli/measure/positions.h"
#include "cli/measure/stopwatch.h"

namespace tessera {

class Contestant {
 public:
  Contestant(std::unique_ptr<LocalWorld> local, const WorldDescription& world)
      : local_(std::move(local)),
        origin_{world.anchor, Eigen::Vector3d::Zero()},
        sector_size_(world.settings.sector_size) {}

  void step() {
    const std::chrono::nanoseconds start = processor_time();
    local_->step();
    ticks_us_.push_back(microseconds(processor_time() - start));
  }

  // Processor times of all ticks.
  const std::vector<double>& ticks_us() const { return ticks_us_; }
  // Their sum over the last `ticks`.
  double spent_us(Tick ticks) const {
    return std::accumulate(ticks_us_.end() - static_cast<std::ptrdiff_t>(ticks), ticks_us_.end(), 0.0);
  }

  // Dynamic bodies, ascending by id.
  std::vector<BodyRecord> bodies() const {
    std::vector<BodyRecord> records = local_->bodies();
    std::erase_if(records, [](const BodyRecord& body) { return body.properties.motion != Motion::kDynamic; });
    return records;
  }
  // Of the same bodies; m, from the centre of the anchor's sector.
  Positions positions() const { return positions_from(origin_, bodies(), sector_size_); }

  std::string hash() const { return local_->hash().to_string(); }

 private:
  std::unique_ptr<LocalWorld> local_;
  WorldPosition origin_;
  double sector_size_;
  std::vector<double> ticks_us_;
};

}  // namespace tessera
