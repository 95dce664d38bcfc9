#include "coordinator/elector.h"

#include <time.h>

#include <utility>

namespace tessera {
namespace {

// It goes on while the machine sleeps, and nobody sets it.
std::chrono::nanoseconds since_boot() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

Elector::Elector(Etcd& etcd, EtcdKeys keys, Election::Options options, std::function<void()> wake)
    : wake_(std::move(wake)),
      election_(etcd, std::move(keys), std::move(options)),
      thread_([this] { run(); }) {}

Elector::~Elector() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  closes_.notify_all();
  thread_.join();
}

void Elector::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    const Election::Role before = election_.role();
    election_.advance(since_boot());
    if (election_.role() != before) wake_();
    closes_.wait_for(lock, kElectionTurn);
  }
}

Elector::View Elector::view() const {
  const std::lock_guard lock(mutex_);
  return {election_.role(),         election_.epoch(), election_.leader(),
          election_.leader_epoch(), election_.state(), election_.cluster_has_ended(),
          election_.trouble()};
}

bool Elector::leads() const {
  const std::lock_guard lock(mutex_);
  return election_.role() == Election::Role::kLeads;
}

void Elector::leader_has_ended() {
  const std::lock_guard lock(mutex_);
  election_.leader_has_ended();
}

void Elector::stand_by() {
  const std::lock_guard lock(mutex_);
  election_.stand_by();
}

void Elector::resign(bool ends_cluster) {
  const std::lock_guard lock(mutex_);
  election_.resign(ends_cluster);
}

}  // namespace tessera
