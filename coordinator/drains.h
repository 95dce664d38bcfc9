// Calls that wait until a server hosts nothing.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <functional>
#include <utility>
#include <vector>

#include "coordinator/limits.h"
#include "lpss/tick/messages.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

class Drains {
 public:
  using Reply = std::function<void(absl::Status, const v1::DrainReply&)>;

  // RESOURCE_EXHAUSTED if add() must not be called at present.
  absl::Status room() const {
    if (waiting_.size() < kWaitingCallsMax) return absl::OkStatus();
    return absl::ResourceExhaustedError(absl::StrCat(waiting_.size(), " calls wait for servers already"));
  }
  void add(NodeId node, Reply reply) { waiting_.push_back({node, std::move(reply)}); }

  // Answers those whose servers are not needed any more; `tick` has been completed.
  void answer(const std::function<bool(NodeId)>& is_needed, Tick tick) {
    std::erase_if(waiting_, [&](const Drain& drain) {
      if (is_needed(drain.node)) return false;
      v1::DrainReply reply;
      reply.set_tick(tick);
      drain.reply(absl::OkStatus(), reply);
      return true;
    });
  }

  // All get `status`.
  void abandon(const absl::Status& status) {
    for (const Drain& drain : std::exchange(waiting_, {})) drain.reply(status, {});
  }

 private:
  struct Drain {
    NodeId node;
    Reply reply;
  };
  std::vector<Drain> waiting_;
};

}  // namespace tessera
