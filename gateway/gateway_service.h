// What a gateway serves: all calls of the services Tessera and Streams, each of which becomes a Relay.
#pragma once

#include <grpcpp/generic/async_generic_service.h>

#include "gateway/routes.h"
#include "gateway/traffic.h"

namespace tessera {

class GatewayService final : public grpc::CallbackGenericService {
 public:
  // `wants_tokens`: calls need one, since certificates of clients end here. `routes` and `traffic` must
  // outlive the server that this is registered with.
  GatewayService(Routes& routes, Traffic& traffic, bool wants_tokens)
      : routes_(routes), traffic_(traffic), wants_tokens_(wants_tokens) {}

  // A call that goes nowhere ends at once: UNIMPLEMENTED for other services, INVALID_ARGUMENT for a stream
  // without a server, UNAUTHENTICATED without a token, RESOURCE_EXHAUSTED where there are too many.
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override;

 private:
  Routes& routes_;
  Traffic& traffic_;
  const bool wants_tokens_;
};

}  // namespace tessera
