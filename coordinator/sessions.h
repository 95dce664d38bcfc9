// The answers to the latest calls of each client, so that a call whose answer was lost can be made again
// without running twice.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"

namespace tessera {

// Bounded: the clients that have not called for longest are forgotten, and of each client its oldest answers.
class Sessions {
 public:
  // Whether to carry out a call. True for a new one: its answer will be remembered. False for one that was
  // made before: it gets the same answer, at once or when it is known; or ABORTED if the answer is forgotten.
  // Calls without an id are always new. No call may be answered after the end of this object.
  template <typename Request, typename Answer>
  bool admit(ClientCall<Request, Answer>& call) {
    if (call.id.session == 0) return true;
    const Take take = [reply = call.reply](const absl::Status& status, const std::string& bytes) {
      Answer answer;
      answer.ParseFromString(bytes);
      reply(status, answer);
    };
    if (!begin(call.id, take)) return false;
    call.reply = [this, id = call.id, reply = std::move(call.reply)](const absl::Status& status,
                                                                     const Answer& answer) {
      reply(status, answer);
      end(id, status, answer.SerializeAsString());
    };
    return true;
  }

  // A call that was answered by an earlier coordinator.
  void remember(CallId id, std::string answer);

 private:
  using Take = std::function<void(const absl::Status&, const std::string&)>;

  struct Call {
    bool is_answered = false;
    std::vector<Take> again;  // of those that made it again meanwhile
    absl::Status status;
    std::string answer;
  };
  struct Session {
    absl::btree_map<std::uint64_t, Call> calls;  // by number
    std::uint64_t forgotten = 0;                 // the largest number that is
    std::list<std::uint64_t>::iterator place;    // in latest_
  };

  bool begin(CallId id, const Take& take);
  void end(CallId id, const absl::Status& status, std::string answer);
  Session& touch(std::uint64_t session);
  static void forget_old(Session& session);
  static void forget(Call& call);

  absl::flat_hash_map<std::uint64_t, Session> sessions_;
  std::list<std::uint64_t> latest_;  // sessions, the one that called last first
};

}  // namespace tessera
