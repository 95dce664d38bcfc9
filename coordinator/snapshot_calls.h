// The calls of the service that stream snapshots: the state machine gives and takes chunks, clients bytes.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>

#include "coordinator/request_queue.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Each posts a request to the queue, and is deleted by gRPC once its call has ended. `calls` counts those
// under way; beyond kSnapshotCallsMax, calls end with RESOURCE_EXHAUSTED. Queue and count must outlive the
// call.
grpc::ServerWriteReactor<v1::SnapshotPiece>* start_snapshot(RequestQueue& queue, std::atomic<int>& calls);
grpc::ServerReadReactor<v1::RestoreRequest>* start_restore(RequestQueue& queue, std::atomic<int>& calls,
                                                           v1::LoadReply* answer);

}  // namespace tessera
