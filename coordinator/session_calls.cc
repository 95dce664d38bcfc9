#include "coordinator/session_calls.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <deque>
#include <memory>
#include <mutex>
#include <utility>

#include "coordinator/call_place.h"
#include "coordinator/limits.h"
#include "coordinator/unanswered.h"
#include "proto/session_header.h"
#include "proto/status.h"

namespace tessera {
namespace {

// Of the headers of a call; 0 where it has none.
std::uint64_t session_of(const grpc::CallbackServerContext& context) {
  std::uint64_t session = 0;
  const auto found = context.client_metadata().find(kSessionHeader);
  if (found == context.client_metadata().end()) return 0;
  const bool is_number =
      absl::SimpleAtoi(absl::string_view(found->second.data(), found->second.size()), &session);
  return is_number ? session : 0;
}

// gRPC's threads and the one that replies use it, and it lives until both are done with it.
class SessionCall final : public grpc::ServerBidiReactor<v1::Request, v1::Reply>,
                          public std::enable_shared_from_this<SessionCall> {
 public:
  SessionCall(RequestQueue& queue, const std::optional<Tokens>& tokens, grpc::CallbackServerContext& context)
      : queue_(queue),
        tokens_(tokens),
        context_(context),
        client_(context.peer()),
        session_(session_of(context)),
        role_(role_of(tokens, context)) {}

  void start() {
    self_ = shared_from_this();
    StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    if (!ok) return update([this] { client_is_done_ = true; });
    const std::uint64_t number = request_.number();
    const std::size_t bytes = request_.ByteSizeLong();
    if (absl::Status may = admit(request_, tokens_, context_); !may.ok()) {
      take(number, may, {}, /*is_counted=*/false);
    } else {
      {
        const std::lock_guard lock(mutex_);
        ++unanswered_;
      }
      ClientRequest posted(ClientCall<v1::Request, v1::Reply>{
          std::exchange(request_, {}),
          [self = shared_from_this(), number](const absl::Status& status, const v1::Reply& reply) {
            self->take(number, status, reply, /*is_counted=*/true);
          },
          {session_, number},
          role_});
      if (absl::Status pushed = queue_.push(posted, bytes, client_); !pushed.ok())
        take(number, pushed, {}, /*is_counted=*/true);
    }
    update([this] { is_reading_ = false; });
  }

  void OnWriteDone(bool ok) override {
    update([&] {
      is_writing_ = false;
      if (ok) {
        replies_.pop_front();
      } else {
        end(client_is_gone());
      }
    });
  }

  void OnCancel() override {
    update([this] { end(client_is_gone()); });
  }

  void OnDone() override { self_.reset(); }

 private:
  void take(std::uint64_t number, const absl::Status& status, const v1::Reply& reply, bool is_counted) {
    update([&] {
      if (is_counted) --unanswered_;
      const grpc::Status told = to_grpc(status);
      if (is_unanswered(status) || stands_by(told)) return end(told);
      v1::Reply& next = replies_.emplace_back(reply);
      next.set_number(number);
      next.set_code(static_cast<std::uint32_t>(told.error_code()));
      next.set_message(told.error_message());
    });
  }

  // The rest is left to another stream.
  void end(const grpc::Status& status) {
    if (!ending_) ending_ = status;
  }

  // Changes what is known, and does what is to be done then. gRPC may call back from within what it is told,
  // so that is not under the lock; the call does not end before, since only this finishes it.
  template <typename Change>
  void update(const Change& change) {
    bool reads = false;
    bool writes = false;
    bool finishes = false;
    {
      const std::lock_guard lock(mutex_);
      change();
      if (client_is_done_ && unanswered_ == 0 && replies_.empty()) end(grpc::Status::OK);
      if (is_finished_) return;
      if (ending_) {
        finishes = is_finished_ = !is_writing_;
      } else {
        writes = !is_writing_ && !replies_.empty();
        is_writing_ = is_writing_ || writes;
        const bool has_room = unanswered_ + replies_.size() < kStreamRequestsMax;
        reads = !is_reading_ && !client_is_done_ && has_room;
        is_reading_ = is_reading_ || reads;
      }
    }
    if (finishes) Finish(*ending_);
    if (writes) StartWrite(&replies_.front());
    if (reads) StartRead(&request_);
  }

  RequestQueue& queue_;
  const std::optional<Tokens>& tokens_;
  grpc::CallbackServerContext& context_;
  const std::string client_;  // its connection
  const std::uint64_t session_;
  const ClientRole role_;
  std::shared_ptr<SessionCall> self_;  // while gRPC has it
  v1::Request request_;                // of the one that reads

  std::mutex mutex_;  // guards the following
  std::deque<v1::Reply> replies_;
  std::size_t unanswered_ = 0;
  bool is_reading_ = true;
  bool is_writing_ = false;
  bool client_is_done_ = false;
  std::optional<grpc::Status> ending_;
  bool is_finished_ = false;
};

}  // namespace

ClientRole role_of(const std::optional<Tokens>& tokens, const grpc::CallbackServerContext& context) {
  if (!tokens) return ClientRole::kAdmin;
  const std::optional<Caller> caller = tokens->caller_of(context.client_metadata(), *context.auth_context());
  return caller ? caller->role : ClientRole::kObserve;
}

absl::Status admit(v1::Request& request, const std::optional<Tokens>& tokens,
                   const grpc::CallbackServerContext& context) {
  const bool only_observes = request.commands().empty() && request.ticks() == 0;
  if (only_observes || !tokens) return absl::OkStatus();
  const std::optional<Caller> caller = tokens->caller_of(context.client_metadata(), *context.auth_context());
  const ClientRole needed = request.ticks() == 0 ? ClientRole::kOwn : ClientRole::kControl;
  if (!caller || caller->role < needed) {
    return absl::PermissionDeniedError(absl::StrCat("the role ", caller ? name_of(caller->role) : "of nobody",
                                                    " may not change a world: it needs ",
                                                    name_of(ClientRole::kControl)));
  }
  if (caller->role > ClientRole::kOwn) return absl::OkStatus();
  if (caller->name.empty()) return absl::PermissionDeniedError("the role own needs a key with a name");
  request.set_owner(caller->name);
  return absl::OkStatus();
}

grpc::ServerBidiReactor<v1::Request, v1::Reply>* start_session(RequestQueue& queue,
                                                               const std::optional<Tokens>& tokens,
                                                               grpc::CallbackServerContext& context) {
  const auto call = std::make_shared<SessionCall>(queue, tokens, context);
  call->start();
  return call.get();
}

}  // namespace tessera
