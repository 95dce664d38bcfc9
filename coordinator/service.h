// The gRPC service Tessera: every call becomes a request to the state machine, and its reply ends the call.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>

#include "coordinator/coordinator.h"
#include "coordinator/request_queue.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Calls wait without a thread. If a client disconnects or its deadline passes, its call ends immediately, but
// its request still takes effect.
class TesseraService final : public v1::Tessera::CallbackService {
 public:
  // `queue` must outlive the server that this is registered with.
  explicit TesseraService(RequestQueue& queue) : queue_(queue) {}

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  Reactor* Load(Context*, const v1::LoadRequest*, v1::LoadReply*) override;
  Reactor* Unload(Context*, const v1::UnloadRequest*, v1::UnloadReply*) override;
  Reactor* Spawn(Context*, const v1::SpawnRequest*, v1::SpawnReply*) override;
  Reactor* Remove(Context*, const v1::RemoveRequest*, v1::CommandReply*) override;
  Reactor* SetVelocity(Context*, const v1::SetVelocityRequest*, v1::CommandReply*) override;
  Reactor* ApplyImpulse(Context*, const v1::ApplyImpulseRequest*, v1::CommandReply*) override;
  Reactor* ApplyForce(Context*, const v1::ApplyForceRequest*, v1::CommandReply*) override;
  Reactor* Teleport(Context*, const v1::TeleportRequest*, v1::CommandReply*) override;
  Reactor* SetKinematicTarget(Context*, const v1::KinematicTargetRequest*, v1::CommandReply*) override;
  Reactor* SetSurfaceMotion(Context*, const v1::SurfaceMotionRequest*, v1::CommandReply*) override;
  Reactor* AddJoint(Context*, const v1::AddJointRequest*, v1::AddJointReply*) override;
  Reactor* RemoveJoint(Context*, const v1::RemoveJointRequest*, v1::CommandReply*) override;
  Reactor* SetJointDrives(Context*, const v1::SetJointDrivesRequest*, v1::CommandReply*) override;
  Reactor* Pause(Context*, const v1::PauseRequest*, v1::PauseReply*) override;
  Reactor* Resume(Context*, const v1::ResumeRequest*, v1::ResumeReply*) override;
  Reactor* Step(Context*, const v1::StepRequest*, v1::StepReply*) override;
  Reactor* GetStatus(Context*, const v1::StatusRequest*, v1::StatusReply*) override;
  Reactor* GetHash(Context*, const v1::HashRequest*, v1::HashReply*) override;
  Reactor* Raycast(Context*, const v1::RaycastRequest*, v1::RaycastReply*) override;
  Reactor* Near(Context*, const v1::NearRequest*, v1::NearReply*) override;
  Reactor* FindBodies(Context*, const v1::FindBodiesRequest*, v1::FindBodiesReply*) override;
  Reactor* ListJoints(Context*, const v1::ListJointsRequest*, v1::ListJointsReply*) override;
  Reactor* ListFrames(Context*, const v1::ListFramesRequest*, v1::ListFramesReply*) override;
  grpc::ServerWriteReactor<v1::SnapshotPiece>* Snapshot(Context*, const v1::SnapshotRequest*) override;
  grpc::ServerReadReactor<v1::RestoreRequest>* Restore(Context*, v1::LoadReply*) override;
  Reactor* Drain(Context*, const v1::DrainRequest*, v1::DrainReply*) override;
  Reactor* Balance(Context*, const v1::BalanceRequest*, v1::BalanceReply*) override;
  Reactor* Shutdown(Context*, const v1::ShutdownRequest*, v1::ShutdownReply*) override;

 private:
  template <typename Request, typename Answer>
  Reactor* post(Context* context, const Request* request, Answer* answer);

  RequestQueue& queue_;
  std::atomic<int> snapshot_calls_ = 0;  // under way, restores included
};

}  // namespace tessera
