#include "coordinator/role_work.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "coordinator/limits.h"

namespace tessera {

double RoleWork::credit_max() const {
  return observe_share_ * static_cast<double>(Nanoseconds(kObserveSavedMax).count());
}

absl::Status RoleWork::admit(ClientRole role, bool world_ticks, Nanoseconds now) {
  credit_ns_ =
      std::min(credit_ns_ + observe_share_ * static_cast<double>((now - last_).count()), credit_max());
  last_ = now;
  ++of(role).requests;
  if (role != ClientRole::kObserve || !world_ticks || credit_ns_ >= 0) return absl::OkStatus();
  ++of(role).refused;
  const double ms = std::ceil(-credit_ns_ / observe_share_ / 1e6);
  return absl::ResourceExhaustedError(
      absl::StrCat("clients of role observe have used up their share of the time while the world ticks, ",
                   100 * observe_share_, " % (--observe-share): ask again in ", ms, " ms"));
}

void RoleWork::add_work(ClientRole role, Nanoseconds work, bool world_ticks) {
  of(role).work += work;
  if (role == ClientRole::kObserve && world_ticks) credit_ns_ -= static_cast<double>(work.count());
}

}  // namespace tessera
