#include "coordinator/service.h"

#include <unistd.h>

#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "coordinator/call_place.h"
#include "coordinator/session_calls.h"
#include "coordinator/snapshot_calls.h"
#include "proto/peak_memory.h"
#include "proto/status.h"

namespace tessera {
namespace {

// One active call. gRPC deletes it through OnDone(); a later reply finds it gone.
template <typename Answer>
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  explicit UnaryCall(Answer* answer) : answer_(answer) {}

  const std::shared_ptr<CallPlace<UnaryCall>>& place() const { return place_; }

  // Of a call that was taken from its place.
  void end(const absl::Status& status, const Answer& answer) {
    *answer_ = answer;
    end(status);
  }
  void end(const absl::Status& status) { Finish(to_grpc(status)); }

  void OnCancel() override {
    if (place_->take() != nullptr) Finish(client_is_gone());
  }
  void OnDone() override { delete this; }

 private:
  Answer* answer_;
  std::shared_ptr<CallPlace<UnaryCall>> place_ = std::make_shared<CallPlace<UnaryCall>>(this);
};

// gRPC keeps the request until the call is answered; it may be a whole world.
template <typename Request, typename Answer>
Request& kept_request(grpc::CallbackServerContext& context, const Request&, const Answer&) {
  return *static_cast<grpc::MessageHolder<Request, Answer>*>(context.GetRpcAllocatorState())->request();
}

// Information that only the process has.
void complete(v1::StatusReply& reply) { reply.set_coordinator_peak_rss_bytes(peak_rss_bytes(getpid())); }

}  // namespace

template <typename Request, typename Answer>
grpc::ServerUnaryReactor* TesseraService::post(Context* context, const Request* request, Answer* answer) {
  auto* call = new UnaryCall<Answer>(answer);
  const auto place = call->place();
  const std::size_t bytes = request->ByteSizeLong();
  const std::string client = context->peer();
  if (absl::Status room = queue_.room_for(bytes, client); !room.ok() && place->take() != nullptr) {
    call->end(room);
    return call;
  }
  ClientRequest posted(ClientCall<Request, Answer>{std::move(kept_request(*context, *request, *answer)),
                                                   [place](const absl::Status& status, const Answer& from) {
                                                     UnaryCall<Answer>* taken = place->take();
                                                     if (taken == nullptr) return;
                                                     if constexpr (std::is_same_v<Answer, v1::StatusReply>) {
                                                       Answer whole = from;
                                                       complete(whole);
                                                       taken->end(status, whole);
                                                     } else {
                                                       taken->end(status, from);
                                                     }
                                                   },
                                                   {},
                                                   role_of(tokens_, *context)});
  if (absl::Status pushed = queue_.push(posted, bytes, client); !pushed.ok() && place->take() != nullptr) {
    call->end(pushed);
  }
  return call;
}

grpc::ServerUnaryReactor* TesseraService::Load(Context* c, const v1::LoadRequest* q, v1::LoadReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Unload(Context* c, const v1::UnloadRequest* q, v1::UnloadReply* a) {
  return post(c, q, a);
}
grpc::ServerBidiReactor<v1::Request, v1::Reply>* TesseraService::Session(Context* context) {
  return start_session(queue_, tokens_, *context);
}
grpc::ServerUnaryReactor* TesseraService::Do(Context* context, const v1::Request* request, v1::Reply* reply) {
  if (absl::Status may = admit(kept_request(*context, *request, *reply), tokens_, *context); !may.ok()) {
    auto* call = new UnaryCall<v1::Reply>(reply);
    call->place()->take()->end(may);
    return call;
  }
  return post(context, request, reply);
}
grpc::ServerUnaryReactor* TesseraService::Pause(Context* c, const v1::PauseRequest* q, v1::PauseReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Resume(Context* c, const v1::ResumeRequest* q, v1::ResumeReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::GetStatus(Context* c, const v1::StatusRequest* q,
                                                    v1::StatusReply* a) {
  return post(c, q, a);
}
grpc::ServerWriteReactor<v1::SnapshotPiece>* TesseraService::Snapshot(Context*, const v1::SnapshotRequest*) {
  return start_snapshot(queue_, snapshot_calls_);
}
grpc::ServerReadReactor<v1::RestoreRequest>* TesseraService::Restore(Context*, v1::LoadReply* a) {
  return start_restore(queue_, snapshot_calls_, a);
}
grpc::ServerUnaryReactor* TesseraService::Drain(Context* c, const v1::DrainRequest* q, v1::DrainReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Balance(Context* c, const v1::BalanceRequest* q,
                                                  v1::BalanceReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Shutdown(Context* c, const v1::ShutdownRequest* q,
                                                   v1::ShutdownReply* a) {
  return post(c, q, a);
}

}  // namespace tessera
