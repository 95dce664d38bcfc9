// Efforts of joints. Streams of joints do not have them, so they are asked for.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tessera/client.h"
#include "tessera/joints.h"

namespace tessera::ros {

// For one thread.
class JointEfforts {
 public:
  JointEfforts() { forget(); }

  // Asks for those of these joints, unless the last answer has not come yet. `client` must live until it
  // does.
  void ask(Client& client, std::vector<JointId> joints);
  // Of the first axis of a joint as last told, N m or N; nothing where it is not known.
  std::optional<double> of(JointId joint) const;
  // Of another world: answers that are on their way do not count.
  void forget();

 private:
  struct Told;  // shared with the answer that is on its way
  std::shared_ptr<Told> told_;
};

}  // namespace tessera::ros
