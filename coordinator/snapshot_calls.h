// The calls of the service that stream snapshots: the state machine gives and takes chunks, clients bytes.
#pragma once

#include <grpcpp/grpcpp.h>

#include "coordinator/request_queue.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Each posts a request to the queue, and is deleted by gRPC once its call has ended.
grpc::ServerWriteReactor<v1::SnapshotPiece>* start_snapshot(RequestQueue& queue);
grpc::ServerReadReactor<v1::RestoreRequest>* start_restore(RequestQueue& queue, v1::LoadReply* answer);

}  // namespace tessera
