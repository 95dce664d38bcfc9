// Joints that programs have removed, which servers tell of: the coordinator takes them out of its list by
// commands of its own, which are stored and recorded as those of clients. Since the sequence of commands says
// when a joint is gone, whoever carries it out again knows it at the same place.
#pragma once

#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/context.h"

namespace tessera {

class TornJoints {
 public:
  // In a replay, the recording has these commands.
  TornJoints(const CoordinatorContext& context, ActiveWorld& world, bool is_replay)
      : context_(context), world_(world), is_replay_(is_replay) {}

  void add(const v1::TickReport& report);
  // Those that wait, where there is room for commands.
  void take_out();

 private:
  const CoordinatorContext& context_;
  ActiveWorld& world_;
  const bool is_replay_;
  std::vector<JointId> waiting_;
};

}  // namespace tessera
