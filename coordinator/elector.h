// The election on a thread of its own: a lease is kept however busy the coordinator is.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "coordinator/election.h"

namespace tessera {

// Safe to use from any thread.
class Elector {
 public:
  // What is known now.
  struct View {
    Election::Role role = Election::Role::kStandsBy;
    std::int64_t epoch = 0;
    std::optional<v1::Leader> leader;
    std::int64_t leader_epoch = 0;
    std::optional<v1::StateRecord> state;
    bool cluster_has_ended = false;
    absl::Status trouble;
  };

  // `wake` is called on that thread when the role changes.
  Elector(Etcd& etcd, EtcdKeys keys, Election::Options options, std::function<void()> wake);
  ~Elector();

  View view() const;
  bool leads() const;

  // As in Election.
  void leader_has_ended();
  void stand_by();
  void resign(bool ends_cluster);

 private:
  void run();

  const std::function<void()> wake_;
  mutable std::mutex mutex_;  // guards the following
  std::condition_variable closes_;
  Election election_;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace tessera
