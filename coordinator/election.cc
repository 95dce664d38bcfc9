#include "coordinator/election.h"

#include <utility>

namespace tessera {
namespace {

using etcdserverpb::TxnRequest;
using etcdserverpb::TxnResponse;

// Takes the result of a call that has ended.
template <typename T>
std::optional<T> take(std::future<T>& future) {
  if (!future.valid() || future.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return std::nullopt;
  return future.get();
}

// A message in a value of etcd; nullopt for what is none.
template <typename Message>
std::optional<Message> parsed(const etcdserverpb::KeyValue& from) {
  Message message;
  if (!message.ParseFromString(from.value())) return std::nullopt;
  return message;
}

}  // namespace

Election::Election(Etcd& etcd, EtcdKeys keys, Options options)
    : etcd_(etcd), keys_(std::move(keys)), options_(std::move(options)) {}

void Election::advance(Nanoseconds now) {
  if (role_ == Role::kLeads) return keep_lease(now);
  if (role_ == Role::kLost) return;
  if (auto response = take(looking_)) {
    trouble_ = response->status();
    if (response->ok()) found(**response, now);
  } else if (auto lease = take(asking_for_lease_)) {
    trouble_ = lease->status();
    if (lease->ok()) {
      lease_ = **lease;
      campaign();
    }
  } else if (auto outcome = take(campaigning_)) {
    trouble_ = outcome->status();
    if (outcome->ok()) won_or_not(**outcome);
  } else if (!looking_.valid() && !asking_for_lease_.valid() && !campaigning_.valid() && now >= next_look_) {
    next_look_ = now + kLookEvery;
    look();
  }
}

void Election::look() {
  TxnRequest request;
  *request.add_success() = read(keys_.leader);
  *request.add_success() = read(keys_.state);
  looking_ = etcd_.transact(std::move(request));
}

void Election::found(const TxnResponse& response, Nanoseconds now) {
  if (response.responses_size() != 2) return;
  const etcdserverpb::KeyValue* leader = only_key(response.responses(0));
  const etcdserverpb::KeyValue* state = only_key(response.responses(1));
  leader_ = leader != nullptr ? parsed<v1::Leader>(*leader) : std::nullopt;
  leader_epoch_ = leader != nullptr ? leader->create_revision() : 0;
  const std::int64_t lease_before = std::exchange(leader_lease_, leader != nullptr ? leader->lease() : 0);
  // Whoever starts after the end of the cluster begins anew.
  if (leader_ && leader_->ends_cluster() && leader_lease_ == lease_before) cluster_has_ended_ = true;
  state_ = state != nullptr ? parsed<v1::StateRecord>(*state) : std::nullopt;
  state_revision_ = state != nullptr ? state->mod_revision() : 0;
  if (leader != nullptr && lease_ != 0 && leader->lease() == lease_) {
    // A call that seemed to fail has made this one the leader.
    epoch_ = leader->create_revision();
    role_ = Role::kLeads;
    return;
  }
  if (leader != nullptr) {
    // The process that was this coordinator before has ended.
    if (leader_ && leader_->name() == options_.name) leader_has_ended();
    return;
  }
  if (state != nullptr && (!state_ || !options_.holds(*state_))) return;
  lease_asked_ = lease_certain_ = now;
  asking_for_lease_ = etcd_.grant_lease(options_.lease);
}

// Where nobody leads, and the state is still the one that this coordinator holds.
void Election::campaign() {
  v1::Leader self;
  self.set_name(options_.name);
  self.set_address(options_.address);
  TxnRequest request;
  *request.add_compare() = created_at(keys_.leader, 0);
  *request.add_compare() = changed_at(keys_.state, state_revision_);
  *request.add_success() = put(keys_.leader, self.SerializeAsString(), lease_);
  campaigning_ = etcd_.transact(std::move(request));
}

void Election::won_or_not(const TxnResponse& response) {
  if (!response.succeeded()) return;
  epoch_ = response.header().revision();
  role_ = Role::kLeads;
}

void Election::keep_lease(Nanoseconds now) {
  if (auto kept = take(keeping_)) {
    trouble_ = kept->status();
    if (kept->ok() && !**kept) {
      role_ = Role::kLost;
      return;
    }
    if (kept->ok()) lease_certain_ = lease_asked_;
  }
  if (now >= lease_certain_ + options_.lease) {
    role_ = Role::kLost;
  } else if (!keeping_.valid() && now >= lease_asked_ + options_.lease / 4) {
    lease_asked_ = now;
    keeping_ = etcd_.keep_alive(lease_);
  }
}

void Election::leader_has_ended() {
  if (role_ != Role::kStandsBy || leader_lease_ == 0) return;
  etcd_.revoke(std::exchange(leader_lease_, 0));
  next_look_ = {};
}

void Election::stand_by() {
  if (lease_ != 0) etcd_.revoke(lease_);
  lease_ = epoch_ = 0;
  keeping_ = {};
  leader_.reset();
  role_ = Role::kStandsBy;
}

void Election::resign(bool ends_cluster) {
  if (role_ != Role::kLeads) return;
  role_ = Role::kLost;
  if (ends_cluster) {
    v1::Leader self;
    self.set_name(options_.name);
    self.set_address(options_.address);
    self.set_ends_cluster(true);
    TxnRequest request;
    *request.add_compare() = created_at(keys_.leader, epoch_);
    *request.add_success() = put(keys_.leader, self.SerializeAsString(), lease_);
    etcd_.transact(std::move(request)).wait();
  } else {
    etcd_.revoke(lease_).wait();
  }
  lease_ = 0;
}

}  // namespace tessera
