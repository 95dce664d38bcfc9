#include "coordinator/membership.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/arithmetic_fingerprint.h"
#include "lpss/model/limits.h"
#include "proto/convert.h"
#include "proto/wire.h"

namespace tessera {

std::chrono::nanoseconds Server::deadline() const {
  const std::chrono::nanoseconds own = last_heard + patience;
  return suspect_since ? std::min(own, *suspect_since + contact_patience) : own;
}

absl::Status Membership::admit(NodeId node, const v1::Hello& hello, Nanoseconds now) {
  if (hello.protocol() != kClusterProtocol) {
    return absl::FailedPreconditionError(absl::StrCat("the server speaks protocol ", hello.protocol(),
                                                      " of the cluster, the coordinator ", kClusterProtocol));
  }
  if (hello.layout() != wire_layout()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the server packs its data by layout ", absl::Hex(hello.layout()),
                     ", the coordinator by ", absl::Hex(wire_layout()), ": both must be of the same build"));
  }
  if (hello.arithmetic() != arithmetic_fingerprint()) {
    const std::string differing =
        differing_arithmetic({hello.arithmetic_parts().data(), std::size_t(hello.arithmetic_parts_size())});
    return absl::FailedPreconditionError(absl::StrCat(
        "the server's arithmetic gives other bits (fingerprint ", absl::Hex(hello.arithmetic()),
        ") than the coordinator's (", absl::Hex(arithmetic_fingerprint()),
        "): both must be built with the same compiler flags and run with the same version of libsleef",
        differing.empty() ? "" : "; they differ in ", differing));
  }
  const absl::StatusOr<Precision> precision = from_proto(hello.precision());
  if (!precision.ok()) return precision.status();
  if (hello.stream_address().size() > kStreamAddressBytesMax) {
    return absl::InvalidArgumentError(absl::StrCat("the stream address's ", hello.stream_address().size(),
                                                   " bytes must be at most ", kStreamAddressBytesMax));
  }
  const double capacity = hello.capacity();
  if (!(capacity >= kCapacityMin && capacity <= kCapacityMax)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the capacity ", capacity, " must be ", kCapacityMin, " to ", kCapacityMax));
  }
  const Labels labels(hello.labels().begin(), hello.labels().end());
  if (absl::Status status = check_labels(labels); !status.ok()) return status;
  if (find(node) != nullptr) return absl::OkStatus();
  if (servers_.size() >= kServersMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the cluster has ", servers_.size(), " servers already, and may have ", kServersMax));
  }
  Server& server = servers_.emplace_back();
  server.node = node;
  server.precision = *precision;
  server.threads = hello.threads();
  server.capacity = capacity;
  server.labels = labels;
  server.stream_address = hello.stream_address();
  server.last_heard = now;
  server.patience = timeout_;
  server.contact_patience = contact_timeout_;
  return absl::OkStatus();
}

const Server* Membership::find(NodeId node) const {
  const auto place = std::ranges::find(servers_, node, &Server::node);
  return place == servers_.end() ? nullptr : &*place;
}

Server* Membership::find(NodeId node) { return const_cast<Server*>(std::as_const(*this).find(node)); }

void Membership::remove(NodeId node) {
  std::erase_if(servers_, [&](const Server& server) { return server.node == node; });
}

std::vector<NodeId> Membership::nodes_of(Precision precision, const Labels& required) const {
  std::vector<NodeId> nodes;
  for (const Server& server : servers_) {
    if (server.precision == precision && !server.drained && has_all(server.labels, required))
      nodes.push_back(server.node);
  }
  return nodes;
}

void Membership::spare_until(Nanoseconds time) {
  for (Server& server : servers_) {
    server.last_heard = std::max(server.last_heard, time - server.patience);
    if (server.suspect_since)
      server.suspect_since = std::max(*server.suspect_since, time - server.contact_patience);
  }
}

std::vector<NodeId> Membership::silent(Nanoseconds now) const {
  std::vector<NodeId> nodes;
  for (const Server& server : servers_) {
    if (now >= server.deadline()) nodes.push_back(server.node);
  }
  return nodes;
}

std::optional<Membership::Nanoseconds> Membership::next_deadline() const {
  std::optional<Nanoseconds> earliest;
  for (const Server& server : servers_) {
    if (!earliest || server.deadline() < *earliest) earliest = server.deadline();
  }
  return earliest;
}

std::string title_of(const Server& server) {
  std::string title = absl::StrCat("server ", absl::Hex(server.node.value));
  if (!server.stream_address.empty()) absl::StrAppend(&title, " (", server.stream_address, ")");
  return title;
}

}  // namespace tessera
