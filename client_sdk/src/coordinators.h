// The coordinators of a cluster, one of which leads, and a connection to each.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "keys/keys_folder.h"
#include "proto/status.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Safe to use from any thread.
class Coordinators {
 public:
  template <typename Request, typename Reply>
  using Method = grpc::Status (v1::Tessera::Stub::*)(grpc::ClientContext*, const Request&, Reply*);

  // `addresses` are separated by commas. Errors as Client::connect().
  static absl::StatusOr<std::shared_ptr<Coordinators>> connect(const std::string& addresses,
                                                               const ClientKeys& keys,
                                                               absl::Duration timeout);

  // One call to the coordinator that leads, with its deadline; `method` is a method of the stub. Where
  // another one leads, or none so far, the call goes to the others until one takes it. A call that was sent
  // and not answered is not made again: it may have taken effect.
  template <typename Request, typename Reply>
  absl::StatusOr<Reply> call(Method<Request, Reply> method, const Request& request, absl::Duration timeout) {
    const absl::Time deadline = absl::Now() + timeout;
    for (;;) {
      const std::size_t place = find(deadline);
      grpc::ClientContext context;
      set_deadline(context, deadline);
      Reply reply;
      const grpc::Status status = (stub(place).*method)(&context, request, &reply);
      leave(place, status);
      if (status.ok()) return reply;
      if (!stands_by(status) || !are_several() || !is_worth_another(deadline))
        return explained(place, from_grpc(status), timeout);
    }
  }

  // The first one from the last leader on that can be reached; without any by the deadline, that leader.
  std::size_t find(absl::Time deadline);
  v1::Tessera::Stub& stub(std::size_t place) { return *members_[place].stub; }
  // A call to it has ended: others are asked first after one that stands by, is gone, or does not answer.
  void leave(std::size_t place, const grpc::Status& status);
  // Whether one whose connection was lost can be asked again, or others can.
  bool comes_back(std::size_t place, absl::Time deadline);

  // A number that no other client has.
  const std::string& session() const { return session_; }

  // That of the coordinator that leads, as far as is known; errors of a call to it go to explained().
  v1::Tessera::Stub& leader(absl::Duration timeout);

  // The status of a call, with where it was made.
  absl::Status explained(const absl::Status& status, absl::Duration timeout) const {
    return explained(place_, status, timeout);
  }

  bool are_several() const { return members_.size() > 1; }
  // Of the one that answered last: where it is a gateway, streams are opened there, too.
  const std::string& address() const { return members_[place_].address; }

  // Waits a little before a call is made again; false, and at once, where its deadline comes before.
  static bool is_worth_another(absl::Time deadline);

 private:
  struct Member {
    std::string address;
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<v1::Tessera::Stub> stub;
  };

  explicit Coordinators(std::vector<Member> members);

  static void set_deadline(grpc::ClientContext& context, absl::Time deadline) {
    if (deadline != absl::InfiniteFuture()) context.set_deadline(absl::ToChronoTime(deadline));
  }
  absl::Status explained(std::size_t place, const absl::Status& status, absl::Duration timeout) const;

  const std::vector<Member> members_;
  const std::string session_;
  std::atomic<std::size_t> place_ = 0;  // of the one that led last
};

}  // namespace tessera
