#include "gateway/daemon_lines.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>

#include "gateway/limits.h"

namespace tessera {
namespace {

// A coordinator that is replaced is back within a second or two.
constexpr int kReconnectMsMin = 100;
constexpr int kReconnectMsMax = 500;
constexpr int kAttemptMs = 1000;
constexpr int kPingEveryMs = 2000;

}  // namespace

std::shared_ptr<grpc::Channel> open_line(const std::string& address, const ClientKeys& keys) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a connection of its own
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kReconnectMsMin);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kAttemptMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kReconnectMsMax);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingEveryMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingEveryMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MIN_SENT_PING_INTERVAL_WITHOUT_DATA_MS, kPingEveryMs / 2);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  return keys.channel(address, arguments);
}

std::shared_ptr<grpc::GenericStub> DaemonLines::take() {
  const std::lock_guard lock(mutex_);
  const auto has_room = [](const std::unique_ptr<Line>& line) { return line->calls < kCallsPerLine; };
  auto found = std::find_if(lines_.begin(), lines_.end(), has_room);
  if (found == lines_.end()) {
    lines_.push_back(std::make_unique<Line>(open_line(address_, keys_)));
    found = std::prev(lines_.end());
  }
  Line* line = found->get();
  ++line->calls;
  const auto leave = [self = shared_from_this(), line](grpc::GenericStub*) {
    const std::lock_guard leaving(self->mutex_);
    --line->calls;
  };
  return {&line->stub, leave};
}

}  // namespace tessera
