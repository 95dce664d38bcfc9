// Which coordinator of a cluster leads: the one whose lease has the key `leader` in etcd.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <optional>
#include <string>

#include "coordinator/etcd.h"
#include "standby.pb.h"

namespace tessera {

// The keys of a cluster. Clusters of different names share an etcd without meeting.
struct EtcdKeys {
  explicit EtcdKeys(const std::string& cluster)
      : leader("tessera/" + cluster + "/leader"),
        state("tessera/" + cluster + "/state"),
        inputs("tessera/" + cluster + "/inputs/") {}

  std::string leader;
  std::string state;
  std::string inputs;  // all that begin with this
};

// One coordinator in the election. It takes part while it stands by, and holds the state that etcd names: so
// whoever leads can go on with the world. Pure logic: it takes the time, calls etcd, and waits for nothing.
//
// Safety rests on etcd alone, on no clock: all that a leader writes is a transaction under the condition that
// the key `leader` is still the one that it made. Time only decides when it stops trying.
class Election {
 public:
  using Nanoseconds = std::chrono::nanoseconds;  // since an arbitrary start; goes on while a machine sleeps

  enum class Role { kStandsBy, kLeads, kLost };

  struct Options {
    std::string name;     // of this coordinator; no two processes have one at the same time
    std::string address;  // where it serves clients and standbys
    std::chrono::seconds lease{3};
    // Whether the state is here.
    std::function<bool(const v1::StateRecord&)> holds;
  };

  // `etcd` must outlive it.
  Election(Etcd& etcd, EtcdKeys keys, Options options);

  // Call it every kElectionTurn or so.
  void advance(Nanoseconds now);

  Role role() const { return role_; }
  // While this one leads: larger than all before.
  std::int64_t epoch() const { return epoch_; }
  // Who leads, as far as this one knows; nullopt: nobody.
  const std::optional<v1::Leader>& leader() const { return leader_; }
  std::int64_t leader_epoch() const { return leader_epoch_; }
  // The state that etcd named last.
  const std::optional<v1::StateRecord>& state() const { return state_; }
  // Whether the leader, which led before, has ended the cluster.
  bool cluster_has_ended() const { return cluster_has_ended_; }
  // Why nothing is known of etcd; OK while it answers.
  const absl::Status& trouble() const { return trouble_; }

  // The process of the leader has ended: others need not wait for the end of its lease. Does no harm where it
  // has not, beyond a change of leaders.
  void leader_has_ended();
  // Gives up leading, or waits for the end of it, and stands by again.
  void stand_by();
  // Gives up leading. With `ends_cluster`, standbys see that they are to end, too.
  void resign(bool ends_cluster);

 private:
  void look();
  void found(const etcdserverpb::TxnResponse& response, Nanoseconds now);
  void campaign();
  void won_or_not(const etcdserverpb::TxnResponse& response);
  void keep_lease(Nanoseconds now);

  Etcd& etcd_;
  const EtcdKeys keys_;
  const Options options_;

  Role role_ = Role::kStandsBy;
  std::int64_t epoch_ = 0;
  std::optional<v1::Leader> leader_;
  std::int64_t leader_epoch_ = 0;
  std::int64_t leader_lease_ = 0;
  std::optional<v1::StateRecord> state_;
  std::int64_t state_revision_ = 0;
  bool cluster_has_ended_ = false;
  absl::Status trouble_;

  Nanoseconds next_look_{};
  std::future<absl::StatusOr<etcdserverpb::TxnResponse>> looking_;
  std::future<absl::StatusOr<std::int64_t>> asking_for_lease_;
  std::future<absl::StatusOr<etcdserverpb::TxnResponse>> campaigning_;

  std::int64_t lease_ = 0;       // of this one; 0: none
  Nanoseconds lease_asked_{};    // when it was last asked for, or to be kept
  Nanoseconds lease_certain_{};  // the time from which it was certain for so long
  std::future<absl::StatusOr<bool>> keeping_;
};

inline constexpr std::chrono::milliseconds kElectionTurn{20};
// How often a standby looks who leads.
inline constexpr std::chrono::milliseconds kLookEvery{200};

}  // namespace tessera
