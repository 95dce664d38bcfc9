#include "client_sdk/live/sampling.h"

#include <algorithm>
#include <cmath>

namespace tessera::live {
namespace {

constexpr double kEveryTicksMax = 1'000'000;

}  // namespace

std::uint32_t ticks_between_frames(const ClusterReport& report, double frames_per_second) {
  if (!report.is_live() || report.cluster.state != "running") return 1;
  const double ticks_per_second =
      std::max(report.cluster.real_time_factor, 1.0) / report.cluster.settings->time_step;
  const double every = std::round(ticks_per_second / frames_per_second);
  return static_cast<std::uint32_t>(std::clamp(every, 1.0, kEveryTicksMax));
}

bool is_far_from(std::uint32_t a, std::uint32_t b) { return a > 2 * b || b > 2 * a || (a == 1) != (b == 1); }

}  // namespace tessera::live
