// An etcd in memory, for tests: it answers at once, keeps its own time, and fails where it is told to.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "coordinator/etcd.h"

namespace tessera::testing {

// Of one thread.
class FakeEtcd final : public Etcd {
 public:
  enum class Fault {
    kNone,
    kLost,        // the request does not arrive
    kUnanswered,  // it takes effect, and the answer is lost
    kLate,        // it takes effect when the next request has
  };

  // What becomes of the next transactions, in their order.
  std::deque<Fault> faults;
  bool answers = true;  // otherwise all calls fail

  // The time of leases.
  void pass(std::chrono::nanoseconds time) {
    now_ += time;
    for (auto lease = leases_.begin(); lease != leases_.end();) {
      const auto here = lease++;
      if (here->second.end <= now_) end_lease(here->first);
    }
  }

  std::size_t keys() const { return keys_.size(); }
  std::size_t keys_with(const std::string& prefix) const {
    std::size_t count = 0;
    for (const auto& [key, entry] : keys_) count += key.starts_with(prefix) ? 1 : 0;
    return count;
  }
  std::size_t largest_request = 0;  // bytes

  std::future<absl::StatusOr<etcdserverpb::TxnResponse>> transact(etcdserverpb::TxnRequest request) override {
    largest_request = std::max(largest_request, request.ByteSizeLong());
    Fault fault = Fault::kNone;
    if (!faults.empty()) {
      fault = faults.front();
      faults.pop_front();
    }
    if (!answers || fault == Fault::kLost) return ready<absl::StatusOr<etcdserverpb::TxnResponse>>(gone());
    if (fault == Fault::kLate) {
      late_.push_back(std::move(request));
      return ready<absl::StatusOr<etcdserverpb::TxnResponse>>(gone());
    }
    absl::StatusOr<etcdserverpb::TxnResponse> response = apply(request);
    for (const etcdserverpb::TxnRequest& late : std::exchange(late_, {})) apply(late).status().IgnoreError();
    if (fault == Fault::kUnanswered) response = gone();
    return ready(std::move(response));
  }

  std::future<absl::StatusOr<std::int64_t>> grant_lease(std::chrono::seconds duration) override {
    if (!answers) return ready<absl::StatusOr<std::int64_t>>(gone());
    leases_[++last_lease_] = {duration, now_ + duration};
    return ready<absl::StatusOr<std::int64_t>>(last_lease_);
  }
  std::future<absl::StatusOr<bool>> keep_alive(std::int64_t lease) override {
    if (!answers) return ready<absl::StatusOr<bool>>(gone());
    const auto found = leases_.find(lease);
    if (found == leases_.end()) return ready<absl::StatusOr<bool>>(false);
    found->second.end = now_ + found->second.duration;
    return ready<absl::StatusOr<bool>>(true);
  }
  std::future<absl::Status> revoke(std::int64_t lease) override {
    if (!answers) return ready<absl::Status>(gone());
    end_lease(lease);
    return ready<absl::Status>(absl::OkStatus());
  }

 private:
  struct Lease {
    std::chrono::nanoseconds duration;
    std::chrono::nanoseconds end;
  };

  template <typename Result>
  static std::future<Result> ready(Result result) {
    std::promise<Result> promise;
    promise.set_value(std::move(result));
    return promise.get_future();
  }
  static absl::Status gone() { return absl::UnavailableError("no answer"); }

  void end_lease(std::int64_t lease) {
    if (leases_.erase(lease) == 0) return;
    ++revision_;
    std::erase_if(keys_, [&](const auto& entry) { return entry.second.lease() == lease; });
  }

  bool holds(const etcdserverpb::Compare& compare) const {
    const auto found = keys_.find(compare.key());
    if (compare.target() == etcdserverpb::Compare::CREATE)
      return compare.create_revision() == (found == keys_.end() ? 0 : found->second.create_revision());
    return compare.mod_revision() == (found == keys_.end() ? 0 : found->second.mod_revision());
  }

  // NOT_FOUND where a key is put under a lease that has ended: nothing is changed then.
  absl::StatusOr<etcdserverpb::TxnResponse> apply(const etcdserverpb::TxnRequest& request) {
    etcdserverpb::TxnResponse response;
    bool all_hold = true;
    for (const etcdserverpb::Compare& compare : request.compare()) all_hold = all_hold && holds(compare);
    response.set_succeeded(all_hold);
    const auto& ops = all_hold ? request.success() : request.failure();
    for (const etcdserverpb::RequestOp& op : ops) {
      const std::int64_t lease = op.has_request_put() ? op.request_put().lease() : 0;
      if (lease != 0 && !leases_.contains(lease)) return absl::NotFoundError("requested lease not found");
    }
    bool changes = false;
    for (const etcdserverpb::RequestOp& op : ops) changes = changes || !op.has_request_range();
    if (changes) ++revision_;
    for (const etcdserverpb::RequestOp& op : ops) do_one(op, *response.add_responses());
    response.mutable_header()->set_revision(revision_);
    return response;
  }

  void do_one(const etcdserverpb::RequestOp& op, etcdserverpb::ResponseOp& response) {
    if (op.has_request_put()) {
      const etcdserverpb::PutRequest& put = op.request_put();
      etcdserverpb::KeyValue& entry = keys_[put.key()];
      if (entry.create_revision() == 0) entry.set_create_revision(revision_);
      entry.set_key(put.key());
      entry.set_value(put.value());
      entry.set_lease(put.lease());
      entry.set_mod_revision(revision_);
      response.mutable_response_put();
    } else if (op.has_request_delete_range()) {
      const auto [first, last] =
          range(op.request_delete_range().key(), op.request_delete_range().range_end());
      keys_.erase(first, last);
      response.mutable_response_delete_range();
    } else {
      const etcdserverpb::RangeRequest& read = op.request_range();
      auto [first, last] = range(read.key(), read.range_end());
      etcdserverpb::RangeResponse& found = *response.mutable_response_range();
      for (; first != last && (read.limit() == 0 || found.kvs_size() < read.limit()); ++first)
        *found.add_kvs() = first->second;
      found.set_more(first != last);
    }
  }

  using Keys = std::map<std::string, etcdserverpb::KeyValue>;
  std::pair<Keys::iterator, Keys::iterator> range(const std::string& key, const std::string& end) {
    if (end.empty()) return keys_.equal_range(key);
    if (end <= key) return {keys_.end(), keys_.end()};
    return {keys_.lower_bound(key), keys_.lower_bound(end)};
  }

  std::chrono::nanoseconds now_{};
  std::int64_t revision_ = 1;
  std::int64_t last_lease_ = 0;
  Keys keys_;
  std::map<std::int64_t, Lease> leases_;
  std::vector<etcdserverpb::TxnRequest> late_;
};

}  // namespace tessera::testing
