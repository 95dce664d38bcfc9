#include "client_sdk/src/coordinators.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <random>
#include <utility>

namespace tessera {
namespace {

// How long one of several may take to accept a connection before the next one is asked, how long one whose
// connection failed is waited for, and the pause before a call is made again.
constexpr absl::Duration kConnectMax = absl::Milliseconds(300);
constexpr absl::Duration kFailedMax = absl::Milliseconds(50);
constexpr absl::Duration kAskAgain = absl::Milliseconds(50);
// An attempt may take several ways there and back: the ends of TCP and TLS meet over slow links, too.
constexpr int kAttemptMs = 1000;
constexpr absl::Duration kAskMax = absl::Seconds(2);  // why a connection fails
// One of several that does not answer pings is as good as gone, although its connection stands.
constexpr int kPingEveryMs = 2000;

std::chrono::system_clock::time_point chrono(absl::Time time) { return absl::ToChronoTime(time); }

std::shared_ptr<grpc::Channel> open_channel(const std::string& address, const ClientKeys& keys,
                                            bool is_one_of_several) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // Of its own, for the coordinator's limits are by connection, and what one has lost another may have.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A coordinator that is replaced is back within a second or two.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kAttemptMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, is_one_of_several ? 200 : 1000);
  if (is_one_of_several) {
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingEveryMs);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingEveryMs);
    arguments.SetInt(GRPC_ARG_HTTP2_MIN_SENT_PING_INTERVAL_WITHOUT_DATA_MS, kPingEveryMs / 2);
    arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  }
  return keys.channel(address, arguments);
}

// Whether the channel is connected, or becomes so. A channel that failed stays so until it is connected, and
// gRPC gets on with that only while somebody waits.
bool is_connected(grpc::Channel& channel, absl::Time deadline) {
  for (;;) {
    const grpc_connectivity_state state = channel.GetState(/*try_to_connect=*/true);
    if (state == GRPC_CHANNEL_READY) return true;
    const bool has_failed = state == GRPC_CHANNEL_TRANSIENT_FAILURE;
    const absl::Time end = has_failed ? std::min(deadline, absl::Now() + kFailedMax) : deadline;
    if (!channel.WaitForStateChange(state, chrono(end))) return false;
  }
}

bool answers(grpc::Channel& channel, absl::Duration& timeout) {
  if (channel.WaitForConnected(chrono(absl::Now() + timeout))) return true;
  if (channel.GetState(/*try_to_connect=*/false) != GRPC_CHANNEL_CONNECTING) return false;
  // A busy coordinator may still answer; one that refuses the connection will not.
  constexpr int kPatience = 10;
  const bool is_late = channel.WaitForConnected(chrono(absl::Now() + (kPatience - 1) * timeout));
  timeout *= kPatience;
  return is_late;
}

// Where something answers that is no coordinator with these keys, what that may be.
std::string why_not(v1::Tessera::Stub& coordinator, const ClientKeys& keys) {
  grpc::ClientContext context;
  context.set_deadline(chrono(absl::Now() + kAskMax));
  v1::StatusReply reply;
  const grpc::Status status = coordinator.GetStatus(&context, v1::StatusRequest(), &reply);
  const std::string reason = status.error_message();
  if (absl::StrContains(reason, "DNS resolution failed")) return ": no host has this name";
  if (status.ok() || absl::StrContains(reason, "refused") || absl::StrContains(reason, "Deadline")) return "";
  return keys.empty() ? ": something listens there, which may want keys (--keys FOLDER or TESSERA_KEYS)"
                      : ": something listens there, which has no keys, or those of another cluster";
}

std::string drawn_session() {
  std::random_device source;
  return absl::StrCat((std::uint64_t{source()} << 32) | source() | 1);
}

}  // namespace

Coordinators::Coordinators(std::vector<Member> members)
    : members_(std::move(members)), session_(drawn_session()) {}

absl::StatusOr<std::shared_ptr<Coordinators>> Coordinators::connect(const std::string& addresses,
                                                                    const ClientKeys& keys,
                                                                    absl::Duration timeout) {
  std::vector<Member> members;
  const std::vector<std::string> all = absl::StrSplit(addresses, ',');
  for (const std::string& address : all) {
    if (!absl::StrContains(address, ':'))
      return absl::InvalidArgumentError(absl::StrCat("address '", address, "' must be host:port"));
    const auto channel = open_channel(address, keys, all.size() > 1);
    members.push_back({address, channel, v1::Tessera::NewStub(channel)});
  }
  const std::shared_ptr<Coordinators> coordinators(new Coordinators(std::move(members)));
  const absl::Time deadline = absl::Now() + timeout;
  const bool is_there =
      coordinators->are_several()
          ? is_connected(*coordinators->members_[coordinators->find(deadline)].channel, deadline)
          : answers(*coordinators->members_.front().channel, timeout);
  if (is_there) return coordinators;
  return absl::UnavailableError(absl::StrCat("no coordinator answers at ", addresses, " within ",
                                             absl::FormatDuration(timeout),
                                             why_not(*coordinators->members_.front().stub, keys)));
}

std::size_t Coordinators::find(absl::Time deadline) {
  const std::size_t first = place_;
  if (!are_several()) return first;
  do {
    for (std::size_t n = 0; n < members_.size(); ++n) {
      const std::size_t place = (first + n) % members_.size();
      if (is_connected(*members_[place].channel, std::min(deadline, absl::Now() + kConnectMax))) return place;
    }
  } while (absl::Now() < deadline);
  return first;
}

v1::Tessera::Stub& Coordinators::leader(absl::Duration timeout) {
  if (are_several()) {
    // Whoever answers leads, and is the one that is asked first from now on.
    static_cast<void>(call(&v1::Tessera::Stub::GetStatus, v1::StatusRequest(), timeout));
  }
  return stub(place_);
}

void Coordinators::leave(std::size_t place, const grpc::Status& status) {
  const bool is_in_doubt = status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                           status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
  if (are_several()) place_ = is_in_doubt ? (place + 1) % members_.size() : place;
}

bool Coordinators::comes_back(std::size_t place, absl::Time deadline) {
  return are_several() || is_connected(*members_[place].channel, deadline);
}

bool Coordinators::is_worth_another(absl::Time deadline) {
  if (absl::Now() + kAskAgain >= deadline) return false;
  absl::SleepFor(kAskAgain);
  return true;
}

absl::Status Coordinators::explained(std::size_t place, const absl::Status& status,
                                     absl::Duration timeout) const {
  const std::string& address = members_[place].address;
  if (status.code() == absl::StatusCode::kUnavailable) {
    return absl::UnavailableError(absl::StrCat("coordinator at ", address, ": ", status.message()));
  }
  if (status.code() == absl::StatusCode::kDeadlineExceeded) {
    return absl::DeadlineExceededError(
        absl::StrCat("coordinator at ", address, ": no answer within ", absl::FormatDuration(timeout)));
  }
  return status;
}

}  // namespace tessera
