// Where the etcd of several coordinators is, and by which keys they reach it.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "coordinator/options.h"
#include "keys/gate.h"

namespace tessera {

struct EtcdMember {
  std::string address;  // host:port
  bool has_tls = false;
};

struct EtcdAccess {
  std::vector<EtcdMember> members;  // of one etcd cluster, one at least
  // Of members with TLS, PEM:
  std::string authority;    // whom they are signed by; empty: one that this machine trusts
  std::string certificate;  // by which etcd knows this coordinator, with `key`; or neither
  std::string key;
};

// Of --etcd ("https://host:port", "http://host:port" or "host:port") and the options beside it. Without any
// of these, coordinators show `keys` to etcd, and expect it to be signed by the same authority.
// INVALID_ARGUMENT for a malformed URL, and for files that go with no https; NOT_FOUND for one that cannot be
// read; FAILED_PRECONDITION for an etcd beyond loopback without TLS, unless --insecure allows it.
absl::StatusOr<EtcdAccess> etcd_access(const CoordinatorArguments& arguments,
                                       const std::optional<ServerKeys>& keys);

}  // namespace tessera
