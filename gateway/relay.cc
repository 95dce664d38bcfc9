#include "gateway/relay.h"

#include <absl/strings/match.h>
#include <absl/strings/string_view.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "proto/server_header.h"
#include "proto/status.h"
#include "tessera.pb.h"

namespace tessera {
namespace {

absl::string_view text(const grpc::string_ref& value) { return {value.data(), value.size()}; }

// What a connection says of itself, and not the client or the daemon.
bool is_of_the_connection(absl::string_view header) {
  constexpr std::array<absl::string_view, 6> kOthers = {"connection", "content-type", "host",
                                                        "te",         "user-agent",   kServerHeader};
  return absl::StartsWith(header, ":") || absl::StartsWith(header, "grpc-") ||
         std::ranges::find(kOthers, header) != kOthers.end();
}

// Messages of protobuf that follow each other are merged when they are read.
grpc::ByteBuffer marked(const grpc::ByteBuffer& status) {
  v1::StatusReply mark;
  mark.set_through_gateway(true);
  std::vector<grpc::Slice> slices;
  if (!status.Dump(&slices).ok()) return status;
  slices.emplace_back(mark.SerializeAsString());
  return {slices.data(), slices.size()};
}

}  // namespace

// The call to the daemon. It is held, so that it is not over while the client's side begins something: until
// nothing more comes of it, and nothing is being written to it.
class Relay::Onward final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit Onward(std::shared_ptr<Relay> relay) : relay_(std::move(relay)) {}

  void start(const std::shared_ptr<grpc::GenericStub>& stub,
             const grpc::GenericCallbackServerContext& client) {
    stub_ = stub;
    context.set_deadline(client.deadline());
    for (const auto& [name, value] : client.client_metadata()) {
      if (!is_of_the_connection(text(name)))
        context.AddMetadata(std::string(text(name)), std::string(text(value)));
    }
    stub_->PrepareBidiStreamingCall(&context, client.method(), {}, this);
    AddHold();
    StartCall();
  }

  void OnReadInitialMetadataDone(bool) override { relay_->headers_came(); }
  void OnReadDone(bool ok) override { relay_->daemon_read(ok); }
  void OnWriteDone(bool) override { relay_->daemon_wrote(); }
  void OnWritesDoneDone(bool) override { relay_->daemon_knows_the_end(); }
  void OnDone(const grpc::Status& status) override {
    const std::shared_ptr<Relay> relay = std::move(relay_);
    relay->daemon_done(status);
  }

  grpc::ClientContext context;

 private:
  std::shared_ptr<Relay> relay_;
  std::shared_ptr<grpc::GenericStub> stub_;
};

struct Relay::Todo {
  bool reads = false;                        // from the client
  const grpc::ByteBuffer* writes = nullptr;  // to the daemon
  bool says_done = false;
  bool asks = false;     // reads from the daemon
  bool replies = false;  // to the client
  bool lets_go = false;
  bool finishes = false;

  bool is_nothing() const {
    return !(reads || writes != nullptr || says_done || asks || replies || lets_go || finishes);
  }
};

Relay::Relay(const RelayedCall& call, grpc::GenericCallbackServerContext& context, Routes& routes,
             Traffic& traffic)
    : user_(routes),
      call_(call),
      context_(context),
      routes_(routes),
      traffic_(traffic),
      counts_(traffic.of(call.server ? Traffic::kStreams : Traffic::kCoordinator)),
      peer_(context.peer()) {}

Relay* Relay::start(const RelayedCall& call, grpc::GenericCallbackServerContext& context, Routes& routes,
                    Traffic& traffic) {
  const auto relay = std::make_shared<Relay>(call, context, routes, traffic);
  relay->self_ = relay;
  ++relay->counts_.calls;
  relay->find_route();
  return relay.get();
}

void Relay::find_route() {
  routes_.find(
      call_.server, context_.deadline(),
      [self = shared_from_this()](const absl::StatusOr<Routes::Lines>& lines) { self->begin(lines); });
}

void Relay::begin(const absl::StatusOr<Routes::Lines>& lines) {
  std::shared_ptr<Onward> onward;
  update([&] {
    if (!lines.ok()) {
      if (!ending_) ending_ = to_grpc(lines.status());
    } else if (!client_is_gone_) {
      lines_ = *lines;
      onward_ = onward = std::make_shared<Onward>(shared_from_this());
      ++acting_;
    }
  });
  if (!onward) return;
  onward->start((*lines)->take(), context_);
  update([&] {
    --acting_;
    has_begun_ = true;
  });
}

void Relay::OnReadDone(bool ok) {
  update([&] {
    is_reading_ = false;
    client_is_done_ = !ok;
    if (!ok) return;
    ++counts_.requests;
    counts_.request_bytes += request_.Length();
    first_request_ = ++requests_ == 1 ? request_ : grpc::ByteBuffer();
    unsent_.push_back(std::move(request_));
    request_.Clear();
  });
}

void Relay::daemon_wrote() {
  update([&] {
    is_writing_ = false;
    unsent_.pop_front();
  });
}

void Relay::daemon_knows_the_end() {
  update([&] { is_writing_ = false; });
}

void Relay::headers_came() {
  update([&] {
    has_headers_ = true;
    for (const auto& [name, value] : onward_->context.GetServerInitialMetadata()) {
      if (!is_of_the_connection(text(name)))
        context_.AddInitialMetadata(std::string(text(name)), std::string(text(value)));
    }
  });
}

void Relay::daemon_read(bool ok) {
  update([&] {
    is_asking_ = false;
    daemon_is_done_ = !ok;
    has_reply_ = ok && !client_is_gone_;
    if (!ok) return;
    ++replies_;
    ++counts_.replies;
    counts_.reply_bytes += reply_.Length();
    if (call_.is_status) reply_ = marked(reply_);
  });
}

void Relay::OnWriteDone(bool ok) {
  update([&] {
    is_replying_ = false;
    has_reply_ = false;
    client_is_gone_ = client_is_gone_ || !ok;
  });
}

void Relay::OnCancel() {
  update([&] {
    client_is_gone_ = true;
    if (onward_) {
      onward_->context.TryCancel();
    } else if (!ending_) {
      ending_ = grpc::Status::CANCELLED;
    }
  });
}

void Relay::OnDone() {
  traffic_.leave(peer_);
  self_.reset();
}

// A coordinator that stands by has done nothing with the call.
bool Relay::may_try_again(const grpc::Status& status) const {
  return stands_by(status) && !call_.server && !client_is_gone_ && requests_ <= 1 && replies_ == 0;
}

void Relay::pass_trailers() {
  for (const auto& [name, value] : onward_->context.GetServerTrailingMetadata()) {
    if (!is_of_the_connection(text(name)))
      context_.AddTrailingMetadata(std::string(text(name)), std::string(text(value)));
  }
}

void Relay::daemon_done(const grpc::Status& status) {
  bool tries_again = false;
  const bool is_in_doubt = status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                           status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
  if (is_in_doubt && !call_.server) routes_.doubt(lines_);
  update([&] {
    tries_again = may_try_again(status);
    if (tries_again) {
      onward_.reset();
      has_begun_ = has_headers_ = daemon_is_done_ = has_let_go_ = has_said_done_ = false;
      if (requests_ == 1 && unsent_.empty()) unsent_.push_back(first_request_);
      return;
    }
    pass_trailers();
    // Only this gateway may have known of a coordinator that stands by.
    if (!ending_)
      ending_ = grpc::Status(status.error_code(), status.error_message(),
                             stands_by(status) ? "" : status.error_details());
  });
  if (tries_again) find_route();
}

// Changes what is known, and does what is to be done then. gRPC may call back from within what it is told, so
// that is not under the lock; and what was decided is done before either side may be over.
template <typename Change>
void Relay::update(const Change& change) {
  const std::shared_ptr<Relay> keep = shared_from_this();
  std::unique_lock lock(mutex_);
  change();
  for (;;) {
    const Todo todo = decide();
    if (todo.is_nothing()) return;
    ++acting_;
    lock.unlock();
    carry_out(todo);
    lock.lock();
    --acting_;
  }
}

Relay::Todo Relay::decide() {
  Todo todo;
  if (is_finished_) return todo;
  if (ending_) {
    todo.finishes = is_finished_ = !is_replying_ && acting_ == 0;
    return todo;
  }
  if (!has_begun_) return todo;
  decide_upward(todo);
  if (has_reply_ && has_headers_ && !is_replying_ && !client_is_gone_) {
    todo.replies = is_replying_ = true;
  } else if (!is_replying_ && !is_asking_ && !daemon_is_done_ && (!has_reply_ || client_is_gone_)) {
    todo.asks = is_asking_ = true;
  }
  if (daemon_is_done_ && !is_writing_ && !has_let_go_ && acting_ == 0 && todo.is_nothing())
    todo.lets_go = has_let_go_ = true;
  return todo;
}

void Relay::decide_upward(Todo& todo) {
  if (is_writing_ || daemon_is_done_) return;
  if (!unsent_.empty()) {
    is_writing_ = true;
    todo.writes = &unsent_.front();
  } else if (client_is_done_) {
    todo.says_done = is_writing_ = !std::exchange(has_said_done_, true);
  } else if (!is_reading_) {
    todo.reads = is_reading_ = true;
  }
}

void Relay::carry_out(const Todo& todo) {
  if (todo.finishes) return Finish(*ending_);
  if (todo.reads) StartRead(&request_);
  if (todo.writes != nullptr) onward_->StartWrite(todo.writes);
  if (todo.says_done) onward_->StartWritesDone();
  if (todo.replies) StartWrite(&reply_);
  if (todo.asks) onward_->StartRead(&reply_);
  if (todo.lets_go) onward_->RemoveHold();
}

}  // namespace tessera
