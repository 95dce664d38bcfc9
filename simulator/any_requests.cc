// Requests with extremes: of every kind, with fields out of bounds, and without waiting for answers.
#include <algorithm>
#include <utility>

#include "simulator/any_message.h"
#include "simulator/workload.h"

namespace tessera {
namespace {

constexpr std::uint64_t kCommandsMax = 12;  // of a list
// Of most lists: one wrong command is enough for all of a list to be refused.
constexpr std::uint64_t kFewCommands = 3;
constexpr std::uint64_t kQueriesMax = 6;
constexpr std::size_t kBodiesMaxKnown = 120;  // then as many are removed as are spawned
constexpr std::size_t kUnansweredAtOnceMax = 8;
constexpr std::uint64_t kLookEvery = 4;
constexpr int kSentTriesMax = 20;
constexpr std::uint64_t kEventsOfAnswersMax = 2'000'000;

bool is_refusal(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kResourceExhausted:
      return true;
    default:
      return false;
  }
}

// What a client must expect of a cluster with faults.
bool is_answer(const absl::Status& status) {
  return status.ok() || absl::IsUnavailable(status) || is_refusal(status);
}

}  // namespace

absl::Status Workload::give_any(SimulatedCluster& cluster) {
  if (absl::Status status = collect(cluster); !status.ok()) return status;
  if (known_.bodies.empty() || dice_.one_in(kLookEvery)) {
    if (absl::Status status = look_around(cluster); !status.ok()) return status;
  }
  const v1::Request request = any_request();
  const bool waits = dice_.one_in(2) || sent_.size() >= kUnansweredAtOnceMax;
  if (!waits) {
    sent_.push_back(post(cluster, request));
    return absl::OkStatus();
  }
  absl::Status status = send(cluster, request);
  if (is_refusal(status)) ++counts_.refused;
  return is_answer(status) ? absl::OkStatus() : status;
}

// Half of what is drawn is as clients make it, so that bodies keep meeting each other.
v1::Request Workload::any_request() {
  v1::Request request;
  if (dice_.one_in(30)) request.set_owner("somebody");
  const bool is_valid = !dice_.one_in(5);
  AnyMessage message(dice_, known_, is_valid);
  const std::uint64_t longest = dice_.one_in(3) ? kCommandsMax : kFewCommands;
  const std::uint64_t commands = dice_.one_in(4) ? 0 : 1 + dice_.below(longest);
  for (std::uint64_t n = 0; n < commands; ++n) {
    if (dice_.one_in(3)) {
      add_command(request);
      continue;
    }
    v1::Command command = message.command();
    const bool is_full = known_.bodies.size() > kBodiesMaxKnown;
    if (command.has_spawn() && is_full) {
      const std::uint64_t id = known_.bodies[dice_.below(known_.bodies.size())].id;
      command.mutable_remove()->mutable_body()->set_id(id);
      forget_body(id);
    }
    *request.add_commands() = std::move(command);
  }
  const std::uint64_t queries = commands > 0 && !dice_.one_in(4) ? 0 : 1 + dice_.below(kQueriesMax);
  for (std::uint64_t n = 0; n < queries; ++n) *request.add_queries() = message.query();
  return request;
}

absl::Status Workload::look_around(SimulatedCluster& cluster) {
  v1::Request request;
  request.add_queries()->mutable_find_bodies();
  request.add_queries()->mutable_find_joints();
  request.add_queries()->mutable_programs();
  const absl::StatusOr<v1::Reply> reply = cluster.call<v1::Request, v1::Reply>(std::move(request));
  if (reply.ok()) {
    known_.learn(reply->results(0).find_bodies(), reply->results(1).find_joints(),
                 reply->results(2).programs());
  }
  return is_answer(reply.status()) ? absl::OkStatus() : reply.status();
}

// What has been answered meanwhile.
absl::Status Workload::collect(SimulatedCluster& cluster) {
  for (std::size_t n = 0; n < sent_.size();) {
    Sent& sent = sent_[n];
    const auto& pending = *sent.first && (*sent.first)->ok() ? sent.first : sent.again;
    if (!*pending) {
      ++n;
      continue;
    }
    const absl::StatusOr<v1::Reply>& reply = **pending;
    if (reply.ok()) take(sent.request, reply->applied());
    if (!is_answer(reply.status())) return reply.status();
    if (is_refusal(reply.status())) ++counts_.refused;
    if (absl::IsUnavailable(reply.status()) && sent.tries < kSentTriesMax) {
      if (cluster.has_coordinator()) post_again(cluster, sent);
      ++n;
      continue;
    }
    sent_.erase(sent_.begin() + static_cast<std::ptrdiff_t>(n));
  }
  return absl::OkStatus();
}

absl::Status Workload::settle(SimulatedCluster& cluster) {
  for (std::uint64_t events = 0; events < kEventsOfAnswersMax; ++events) {
    if (absl::Status status = collect(cluster); !status.ok() || sent_.empty()) return status;
    if (!cluster.failure().ok()) return cluster.failure();
    cluster.run_events(1);
  }
  return absl::DeadlineExceededError("requests that nobody waited for were not answered");
}

}  // namespace tessera
