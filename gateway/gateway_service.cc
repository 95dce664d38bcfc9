#include "gateway/gateway_service.h"

#include <absl/status/statusor.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include "gateway/relay.h"
#include "proto/server_header.h"
#include "proto/status.h"

namespace tessera {
namespace {

constexpr absl::string_view kCoordinators = "/tessera.v1.Tessera/";
constexpr absl::string_view kStatus = "/tessera.v1.Tessera/GetStatus";
constexpr absl::string_view kServers = "/tessera.v1.Streams/";

class Refusal final : public grpc::ServerGenericBidiReactor {
 public:
  explicit Refusal(const absl::Status& why) { Finish(to_grpc(why)); }
  void OnDone() override { delete this; }
};

absl::StatusOr<RelayedCall> destination(const grpc::GenericCallbackServerContext& context) {
  RelayedCall call;
  call.is_status = context.method() == kStatus;
  if (absl::StartsWith(context.method(), kCoordinators)) return call;
  if (!absl::StartsWith(context.method(), kServers))
    return absl::UnimplementedError(
        "a gateway passes on calls of tessera.v1.Tessera and tessera.v1.Streams only");
  const auto given = context.client_metadata().find(kServerHeader);
  std::uint64_t node = 0;
  if (given == context.client_metadata().end() ||
      !absl::SimpleAtoi(absl::string_view(given->second.data(), given->second.size()), &node)) {
    return absl::InvalidArgumentError(
        absl::StrCat("through a gateway, a stream needs the header ", kServerHeader,
                     " with the node of a sector server, in decimal digits, as GetStatus tells it"));
  }
  call.server = node;
  return call;
}

}  // namespace

grpc::ServerGenericBidiReactor* GatewayService::CreateReactor(grpc::GenericCallbackServerContext* context) {
  const absl::StatusOr<RelayedCall> call = destination(*context);
  if (!call.ok()) return new Refusal(call.status());
  if (wants_tokens_ && context->client_metadata().count("authorization") == 0) {
    return new Refusal(absl::UnauthenticatedError(
        "through a gateway, a client needs the token of its keys: certificates end at the gateway"));
  }
  if (!traffic_.enter(context->peer())) {
    return new Refusal(absl::ResourceExhaustedError(
        "the gateway has as many calls under way as it takes, of all clients or of this one"));
  }
  return Relay::start(*call, *context, routes_, traffic_);
}

}  // namespace tessera
