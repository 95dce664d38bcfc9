// The requests of each client that it may make again, so that one whose reply was lost is carried out once.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <vector>

#include "coordinator/coordinator.h"

namespace tessera {

// Numbers, mostly without gaps.
class NumberSet {
 public:
  bool contains(std::uint64_t number) const;
  void add(std::uint64_t number);
  void add_up_to(std::uint64_t number);
  std::size_t gaps() const { return runs_.size(); }

 private:
  std::uint64_t up_to_ = 0;
  absl::btree_map<std::uint64_t, std::uint64_t> runs_;  // beyond: the last of each by its first
};

// Bounded: the clients that have not called for longest are forgotten.
class Sessions {
 public:
  using Call = ClientCall<v1::Request, v1::Reply>;
  using Reply = std::function<void(const absl::Status&, const v1::Reply&)>;

  // What to do with a request.
  struct Admission {
    bool is_taken = false;                   // it gets its reply, or an error: nothing is to be done
    std::optional<v1::Applied> carried_out;  // what its commands did when it was made before: they are not
                                             // carried out again, and it is replied to
  };

  // The reply will be remembered until the client says that it has it. A request that was made before gets
  // the same reply, at once or when it is known. INVALID_ARGUMENT without a number, ABORTED for a request
  // whose reply the client has, RESOURCE_EXHAUSTED beyond kUnansweredMax. Requests without a session are
  // always new. No request may be replied to after the end of this object.
  Admission admit(Call& call);

  // What the client says of the replies that it has, in a request that need not be admitted: it changes
  // nothing.
  void take_answered(const Call& call);

  // What the commands of a request did that was admitted.
  void note(RequestId id, const v1::Applied& applied);

  // Of all requests that clients may make again, as far as it is known what they did.
  void for_each(const std::function<void(RequestId, const v1::Applied&)>& visit) const;

  // A request that an earlier coordinator carried out. Beyond kUnansweredMax of a client, the first ones are
  // refused from then on, as if the client had their replies.
  void remember(RequestId id, const v1::Applied& applied);

 private:
  struct Request {
    bool is_answered = false;
    std::vector<Reply> again;  // of those that made it again meanwhile
    absl::Status status;
    v1::Reply reply;
    std::optional<v1::Applied> applied;
    std::optional<v1::Applied> carried_out;  // by an earlier coordinator, and not replied to by this one
  };
  struct Session {
    absl::btree_map<std::uint64_t, Request> requests;  // by number
    NumberSet answered;                                // what the client has the replies to
    std::list<std::uint64_t>::iterator place;          // in latest_
  };

  Session& touch(std::uint64_t session);
  static void forget_answered(Session& session, const v1::Request& request);
  void end(RequestId id, const absl::Status& status, const v1::Reply& reply);

  absl::flat_hash_map<std::uint64_t, Session> sessions_;
  std::list<std::uint64_t> latest_;  // sessions, the one that called last first
};

}  // namespace tessera
