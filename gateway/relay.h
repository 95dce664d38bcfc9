// A call that is passed on, message by message, without a look at what is in them.
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "gateway/routes.h"
#include "gateway/traffic.h"

namespace tessera {

// Where a call of a client is to go.
struct RelayedCall {
  std::optional<std::uint64_t> server;  // none: to the coordinator that leads
  bool is_status = false;               // GetStatus, whose reply says that it came through a gateway
};

// Of each direction, one message at most is here: whoever takes none holds up the other side, and nothing
// else. Headers, status and cancellation are passed on, too. A call that a coordinator refuses since it
// stands by is made again, to the one that leads, as long as only one message has come for it.
class Relay final : public grpc::ServerGenericBidiReactor, public std::enable_shared_from_this<Relay> {
 public:
  // Lives until the call is over. `routes` and `traffic` must outlive it.
  static Relay* start(const RelayedCall& call, grpc::GenericCallbackServerContext& context, Routes& routes,
                      Traffic& traffic);

  Relay(const RelayedCall& call, grpc::GenericCallbackServerContext& context, Routes& routes,
        Traffic& traffic);

  // Called by gRPC.
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  class Onward;
  struct Todo;

  void find_route();
  void begin(const absl::StatusOr<Routes::Lines>& lines);
  // What becomes of the call to the daemon.
  void headers_came();
  void daemon_read(bool ok);
  void daemon_wrote();
  void daemon_knows_the_end();
  void daemon_done(const grpc::Status& status);

  template <typename Change>
  void update(const Change& change);
  Todo decide();
  void decide_upward(Todo& todo);
  void carry_out(const Todo& todo);
  bool may_try_again(const grpc::Status& status) const;
  void pass_trailers();

  const Routes::User user_;  // ends after all else
  const RelayedCall call_;
  grpc::GenericCallbackServerContext& context_;
  Routes& routes_;
  Traffic& traffic_;
  Traffic::Counts& counts_;
  const std::string peer_;       // gRPC forgets it with the connection
  std::shared_ptr<Relay> self_;  // while gRPC has it

  std::mutex mutex_;  // guards the following
  int acting_ = 0;    // threads that do what was decided: neither side may be over before they have
  Routes::Lines lines_;
  std::shared_ptr<Onward> onward_;  // null while the route is looked for
  bool has_begun_ = false;          // onward_
  std::optional<grpc::Status> ending_;
  bool is_finished_ = false;
  bool client_is_gone_ = false;

  // To the daemon.
  grpc::ByteBuffer request_;             // that is being read
  std::deque<grpc::ByteBuffer> unsent_;  // a call that is made again may have read on meanwhile: two at most
  grpc::ByteBuffer first_request_;       // while the call may have to be made again
  std::uint64_t requests_ = 0;
  bool is_reading_ = false;  // from the client
  bool client_is_done_ = false;
  bool is_writing_ = false;  // to the daemon
  bool has_said_done_ = false;
  // From the daemon.
  grpc::ByteBuffer reply_;
  std::uint64_t replies_ = 0;
  bool has_headers_ = false;
  bool is_asking_ = false;  // reads from the daemon
  bool has_reply_ = false;  // to be written
  bool is_replying_ = false;
  bool daemon_is_done_ = false;
  bool has_let_go_ = false;  // of the call to the daemon, which then ends
};

}  // namespace tessera
