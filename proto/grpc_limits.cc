#include "proto/grpc_limits.h"

#include <grpc/compression.h>
#include <grpcpp/resource_quota.h>

namespace tessera {
namespace {

// Limits of messages count what comes over the network, and that may be a thousandth of what it unfolds to.
constexpr int kCompression = 1 << GRPC_COMPRESS_NONE;

}  // namespace

void limit_clients(grpc::ServerBuilder& builder, int threads_max) {
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, static_cast<int>(kClientSilenceMax.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, static_cast<int>(kClientAnswerMax.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             static_cast<int>(kClientAsksMin.count()));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS,
                             static_cast<int>(kClientHandshakeMax.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, static_cast<int>(kClientIdleMax.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kCallsPerConnectionMax);
  builder.AddChannelArgument(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, kCompression);
  grpc::ResourceQuota quota;
  quota.SetMaxThreads(threads_max);
  quota.Resize(kMessagesInFlightBytesMax);
  builder.SetResourceQuota(quota);
}

}  // namespace tessera
