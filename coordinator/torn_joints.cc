#include "coordinator/torn_joints.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "coordinator/command_list.h"
#include "coordinator/limits.h"
#include "coordinator/sequence_list.h"
#include "lpss/base/invariant.h"

namespace tessera {

void TornJoints::add(const v1::TickReport& report) {
  if (is_replay_) return;
  for (const std::uint64_t joint : report.removed_joints()) waiting_.push_back(JointId{joint});
}

// Where ticks are repeated, some are told again.
void TornJoints::take_out() {
  if (waiting_.empty()) return;
  std::ranges::sort(waiting_);
  const auto [repeated, end] = std::ranges::unique(waiting_);
  waiting_.erase(repeated, end);
  std::erase_if(waiting_, [this](JointId id) { return world_.registry.joints().find(id) == nullptr; });
  const std::size_t count = std::min(waiting_.size(), static_cast<std::size_t>(kCommandsPerListMax));
  if (count == 0 || !context_.journal.room().ok() || !world_.sequencer.room_for_commands(count, 0).ok())
    return;
  v1::RecordedCommands recorded = next_record(world_.registry, world_.sequencer.next_command_tick());
  for (std::size_t n = 0; n < count; ++n)
    recorded.add_commands()->mutable_remove_joint()->mutable_joint()->set_id(waiting_[n].value);
  absl::StatusOr<GivenCommands> given = give(recorded.commands(), world_.registry, recorded.tick());
  invariant(given.ok(), "a joint that is in the list can be removed");
  world_.registry.keep();
  sequence_list(context_, world_, *std::move(given), std::move(recorded), {});
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace tessera
