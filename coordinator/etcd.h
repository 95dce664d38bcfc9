// What coordinators need of etcd, as values: transactions and leases.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <future>
#include <string>

#include "etcd.pb.h"

namespace tessera {

// Calls may be made from any thread, and several at a time. Each ends by itself, within kEtcdCallMax; of one
// that ends with an error, nobody knows whether it has taken effect: it may even do so later.
class Etcd {
 public:
  virtual ~Etcd() = default;

  // RESOURCE_EXHAUSTED where etcd's quota is used up, otherwise the errors of its API.
  virtual std::future<absl::StatusOr<etcdserverpb::TxnResponse>> transact(
      etcdserverpb::TxnRequest request) = 0;

  // A lease that ends unless it is kept alive.
  virtual std::future<absl::StatusOr<std::int64_t>> grant_lease(std::chrono::seconds duration) = 0;
  // False where it has ended.
  virtual std::future<absl::StatusOr<bool>> keep_alive(std::int64_t lease) = 0;
  // Ends it, with the keys that have it.
  virtual std::future<absl::Status> revoke(std::int64_t lease) = 0;
};

inline constexpr std::chrono::seconds kEtcdCallMax{2};
// etcd refuses requests above 1.5 MiB; what is longer travels in pieces of this size.
inline constexpr std::size_t kEtcdValueBytesMax = std::size_t{1} << 20;
inline constexpr std::int64_t kEtcdKeysPerRead = 64;

// Conditions of a transaction. A revision of 0: there is no such key.
etcdserverpb::Compare created_at(const std::string& key, std::int64_t revision);
etcdserverpb::Compare changed_at(const std::string& key, std::int64_t revision);

// Its parts. A `lease` of 0: none; an empty `end`: the key alone.
etcdserverpb::RequestOp put(const std::string& key, std::string value, std::int64_t lease = 0);
etcdserverpb::RequestOp erase(const std::string& key, const std::string& end = {});
etcdserverpb::RequestOp read(const std::string& key, const std::string& end = {}, std::int64_t keys_max = 0);

// The end of the range of all keys that begin with `prefix`, which ends with a character below 0xff.
std::string end_of(std::string prefix);

// The only key of a read; null: there is none.
const etcdserverpb::KeyValue* only_key(const etcdserverpb::ResponseOp& response);

}  // namespace tessera
