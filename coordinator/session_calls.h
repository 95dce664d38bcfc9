// The call of the service that streams requests and replies.
#pragma once

#include <grpcpp/grpcpp.h>

#include <optional>

#include "coordinator/request_queue.h"
#include "keys/gate.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Of the client of a call that was let in; without tokens, everybody may do everything.
ClientRole role_of(const std::optional<Tokens>& tokens, const grpc::CallbackServerContext& context);

// PERMISSION_DENIED for a request that changes a world, from whom `tokens` give a role that may not do so. Of
// one that may command what it owns, the request then has the client's name as owner. Without tokens,
// everybody may do everything.
absl::Status admit(v1::Request& request, const std::optional<Tokens>& tokens,
                   const grpc::CallbackServerContext& context);

// Posts each request to the queue, and writes the replies as they come; no more than kStreamRequestsMax are
// under way, up to where the client reads them. Ends, with UNAVAILABLE, when a request is left to another
// coordinator, and once the client has ended its side and has all replies. Queue and tokens must outlive the
// call.
grpc::ServerBidiReactor<v1::Request, v1::Reply>* start_session(RequestQueue& queue,
                                                               const std::optional<Tokens>& tokens,
                                                               grpc::CallbackServerContext& context);

}  // namespace tessera
