#include "ros/joint_efforts.h"

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <mutex>
#include <utility>

#include "ros/node.h"

namespace tessera::ros {

struct JointEfforts::Told {
  std::mutex mutex;
  bool is_asked = false;
  absl::flat_hash_map<std::uint64_t, double> efforts;  // by the id of the joint
};

void JointEfforts::ask(Client& client, std::vector<JointId> joints) {
  if (joints.empty()) return;
  {
    const std::lock_guard lock(told_->mutex);
    if (std::exchange(told_->is_asked, true)) return;
  }
  Batch batch;
  const auto place = batch.queries.joint_states({.ids = std::move(joints), .efforts = true});
  client.send(batch, [told = told_, place](const absl::StatusOr<Answers>& answers) {
    warn(answers.status());
    const std::lock_guard lock(told->mutex);
    told->is_asked = false;
    if (!answers.ok()) return;
    for (const JointValues& joint : (*answers)[place]) {
      if (!joint.efforts.empty()) told->efforts[joint.id.value] = joint.efforts.front();
    }
  });
}

std::optional<double> JointEfforts::of(JointId joint) const {
  const std::lock_guard lock(told_->mutex);
  const auto found = told_->efforts.find(joint.value);
  return found == told_->efforts.end() ? std::nullopt : std::optional(found->second);
}

void JointEfforts::forget() { told_ = std::make_shared<Told>(); }

}  // namespace tessera::ros
