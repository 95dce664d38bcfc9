#include "coordinator/service.h"

#include <absl/strings/numbers.h>
#include <absl/strings/string_view.h>
#include <unistd.h>

#include <memory>
#include <type_traits>
#include <utility>

#include "coordinator/call_place.h"
#include "coordinator/snapshot_calls.h"
#include "coordinator/unanswered.h"
#include "proto/call_id.h"
#include "proto/peak_memory.h"
#include "proto/status.h"

namespace tessera {
namespace {

// One active call. gRPC deletes it through OnDone(); a later reply finds it gone.
template <typename Answer>
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  UnaryCall(grpc::CallbackServerContext* context, Answer* answer) : context_(context), answer_(answer) {}

  const std::shared_ptr<CallPlace<UnaryCall>>& place() const { return place_; }

  // Of a call that was taken from its place.
  void end(const absl::Status& status, const Answer& answer) {
    *answer_ = answer;
    end(status);
  }
  void end(const absl::Status& status) {
    if (!is_unanswered(status)) context_->AddTrailingMetadata(kAnsweredTrailer, "1");
    Finish(to_grpc(status));
  }

  void OnCancel() override {
    if (place_->take() != nullptr) Finish(client_is_gone());
  }
  void OnDone() override { delete this; }

 private:
  grpc::CallbackServerContext* context_;
  Answer* answer_;
  std::shared_ptr<CallPlace<UnaryCall>> place_ = std::make_shared<CallPlace<UnaryCall>>(this);
};

// Information that only the process has.
void complete(v1::StatusReply& reply) { reply.set_coordinator_peak_rss_bytes(peak_rss_bytes(getpid())); }

// Of the headers of a call; session 0 where it has none.
CallId call_id(const grpc::CallbackServerContext& context) {
  const auto number = [&](const char* header) {
    std::uint64_t value = 0;
    const auto found = context.client_metadata().find(header);
    const bool is_number =
        found != context.client_metadata().end() &&
        absl::SimpleAtoi(absl::string_view(found->second.data(), found->second.size()), &value);
    return is_number ? value : 0;
  };
  return {number(kSessionHeader), number(kCallHeader)};
}

}  // namespace

template <typename Request, typename Answer>
grpc::ServerUnaryReactor* TesseraService::post(Context* context, const Request* request, Answer* answer) {
  auto* call = new UnaryCall<Answer>(context, answer);
  const auto place = call->place();
  const std::size_t bytes = request->ByteSizeLong();
  if (absl::Status room = queue_.room_for(bytes); !room.ok() && place->take() != nullptr) {
    call->end(room);
    return call;
  }
  // gRPC keeps the request until the call is answered; it may be a whole world.
  Request& kept =
      *static_cast<grpc::MessageHolder<Request, Answer>*>(context->GetRpcAllocatorState())->request();
  ClientRequest posted(ClientCall<Request, Answer>{std::move(kept),
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
                                                   call_id(*context)});
  if (absl::Status pushed = queue_.push(posted, bytes); !pushed.ok() && place->take() != nullptr) {
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
grpc::ServerUnaryReactor* TesseraService::Spawn(Context* c, const v1::SpawnRequest* q, v1::SpawnReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Remove(Context* c, const v1::RemoveRequest* q,
                                                 v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::SetVelocity(Context* c, const v1::SetVelocityRequest* q,
                                                      v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::ApplyImpulse(Context* c, const v1::ApplyImpulseRequest* q,
                                                       v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::ApplyForce(Context* c, const v1::ApplyForceRequest* q,
                                                     v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Teleport(Context* c, const v1::TeleportRequest* q,
                                                   v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::SetKinematicTarget(Context* c, const v1::KinematicTargetRequest* q,
                                                             v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::SetSurfaceMotion(Context* c, const v1::SurfaceMotionRequest* q,
                                                           v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::AddJoint(Context* c, const v1::AddJointRequest* q,
                                                   v1::AddJointReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::RemoveJoint(Context* c, const v1::RemoveJointRequest* q,
                                                      v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::SetJointDrives(Context* c, const v1::SetJointDrivesRequest* q,
                                                         v1::CommandReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Pause(Context* c, const v1::PauseRequest* q, v1::PauseReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Resume(Context* c, const v1::ResumeRequest* q, v1::ResumeReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Step(Context* c, const v1::StepRequest* q, v1::StepReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::GetStatus(Context* c, const v1::StatusRequest* q,
                                                    v1::StatusReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::GetHash(Context* c, const v1::HashRequest* q, v1::HashReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::Raycast(Context* c, const v1::RaycastRequest* q,
                                                  v1::RaycastReply* a) {
  return post(c, q, a);
}

grpc::ServerUnaryReactor* TesseraService::Near(Context* c, const v1::NearRequest* q, v1::NearReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::FindBodies(Context* c, const v1::FindBodiesRequest* q,
                                                     v1::FindBodiesReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::ListJoints(Context* c, const v1::ListJointsRequest* q,
                                                     v1::ListJointsReply* a) {
  return post(c, q, a);
}
grpc::ServerUnaryReactor* TesseraService::ListFrames(Context* c, const v1::ListFramesRequest* q,
                                                     v1::ListFramesReply* a) {
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
