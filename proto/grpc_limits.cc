#include "proto/grpc_limits.h"

#include <grpcpp/resource_quota.h>

namespace tessera {

void limit_clients(grpc::ServerBuilder& builder, int threads_max) {
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, static_cast<int>(kClientSilenceMax.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, static_cast<int>(kClientAnswerMax.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             static_cast<int>(kClientAsksMin.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kCallsPerConnectionMax);
  grpc::ResourceQuota quota;
  quota.SetMaxThreads(threads_max);
  quota.Resize(kMessagesInFlightBytesMax);
  builder.SetResourceQuota(quota);
}

}  // namespace tessera
