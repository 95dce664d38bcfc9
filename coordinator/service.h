// The gRPC service Tessera: every call becomes a request to the state machine, and its reply ends the call.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <optional>
#include <utility>

#include "coordinator/coordinator.h"
#include "coordinator/request_queue.h"
#include "keys/gate.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Calls wait without a thread. If a client disconnects or its deadline passes, its call ends immediately, but
// its request still takes effect.
class TesseraService final : public v1::Tessera::CallbackService {
 public:
  // `queue` must outlive the server that this is registered with. `tokens`: those who may call; none:
  // everybody.
  TesseraService(RequestQueue& queue, std::optional<Tokens> tokens)
      : queue_(queue), tokens_(std::move(tokens)) {}

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  Reactor* Load(Context*, const v1::LoadRequest*, v1::LoadReply*) override;
  Reactor* Unload(Context*, const v1::UnloadRequest*, v1::UnloadReply*) override;
  grpc::ServerBidiReactor<v1::Request, v1::Reply>* Session(Context*) override;
  Reactor* Do(Context*, const v1::Request*, v1::Reply*) override;
  Reactor* Pause(Context*, const v1::PauseRequest*, v1::PauseReply*) override;
  Reactor* Resume(Context*, const v1::ResumeRequest*, v1::ResumeReply*) override;
  Reactor* GetStatus(Context*, const v1::StatusRequest*, v1::StatusReply*) override;
  grpc::ServerWriteReactor<v1::SnapshotPiece>* Snapshot(Context*, const v1::SnapshotRequest*) override;
  grpc::ServerReadReactor<v1::RestoreRequest>* Restore(Context*, v1::LoadReply*) override;
  Reactor* Drain(Context*, const v1::DrainRequest*, v1::DrainReply*) override;
  Reactor* Balance(Context*, const v1::BalanceRequest*, v1::BalanceReply*) override;
  Reactor* Shutdown(Context*, const v1::ShutdownRequest*, v1::ShutdownReply*) override;

 private:
  template <typename Request, typename Answer>
  Reactor* post(Context* context, const Request* request, Answer* answer);

  RequestQueue& queue_;
  const std::optional<Tokens> tokens_;
  std::atomic<int> snapshot_calls_ = 0;  // under way, restores included
};

}  // namespace tessera
