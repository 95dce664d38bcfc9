// A store for two or more coordinators: inputs in etcd, states as files in the folder of each coordinator,
// and in etcd which of them counts. What is here outlives the host of the coordinator that leads.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/election.h"
#include "coordinator/etcd.h"
#include "coordinator/state_folder.h"
#include "coordinator/world_store.h"

namespace tessera {

// Where states are copied to: the standbys of a leader; see StateCopies.
struct CopyPlaces {
  // The state that etcd names (empty: there is none), and one that is to take its place (likewise).
  std::function<void(std::string recorded, std::string next)> offer;
  // Who has a state; nullopt while it is to be waited for.
  std::function<std::optional<std::vector<std::string>>(const std::string& name)> holders;
};

// Of the leader of one epoch. What it writes is lost together with its leadership, and nothing else: it waits
// for an etcd that does not answer, or has no room.
class EtcdStore final : public WorldStore {
 public:
  struct Options {
    std::int64_t epoch = 0;
    std::function<bool()> leads;  // whether it is worth to go on waiting
    CopyPlaces copies;
    std::function<void(const std::string&)> warn;  // of what the operator should know; may be empty
  };

  // Reads what is there. `etcd` and `folder` must outlive the store. DATA_LOSS where it is not as it was
  // written, ABORTED where another coordinator leads.
  static absl::StatusOr<std::unique_ptr<EtcdStore>> open(Etcd& etcd, const EtcdKeys& keys,
                                                         StateFolder& folder, Options options);

  // A state that is being written is of no use any more.
  ~EtcdStore() override;

  // Whether another coordinator leads. Nothing is written any more, and nothing of what was told since is
  // true.
  bool lost() const { return lost_; }

  std::optional<StoredWorld> take_stored() override { return std::exchange(stored_world_, std::nullopt); }
  absl::Status begin(std::uint64_t load, const StoredState& state) override;
  absl::Status end() override;
  absl::Status append(const std::vector<v1::StoredInput>& inputs) override;
  std::uint64_t position() const override { return position_; }
  std::uint64_t stored() const override { return stored_; }
  bool wants_whole() const override { return wants_whole_; }
  bool change(StateChange change, std::uint64_t position) override;
  absl::Status tend() override;

 private:
  // A state that is to be named in etcd.
  struct Next {
    v1::StateRecord record;
    std::future<absl::Status> writing;  // invalid once it is on disk
    std::chrono::steady_clock::time_point offered;
    // It is recorded after these inputs: the pace is among them, which it does not have.
    std::uint64_t after;
  };
  struct Piece {
    etcdserverpb::RequestOp put;
    std::uint64_t stored = 0;  // the last input that is in etcd once this is; 0: a batch that is not whole
  };

  EtcdStore(Etcd& etcd, EtcdKeys keys, StateFolder& folder, Options options)
      : etcd_(etcd), keys_(std::move(keys)), folder_(folder), options_(std::move(options)) {}

  absl::Status read_all();
  absl::Status read_inputs(StoredWorld& world);
  std::string draw_name();
  v1::StateRecord record_of(std::string name, std::uint64_t position) const;
  std::string input_key(std::uint64_t last) const;
  void make_pieces();
  bool is_next_held();
  etcdserverpb::TxnRequest guarded() const;
  etcdserverpb::TxnRequest recording(const std::optional<v1::StateRecord>& record) const;
  bool is_recorded(const etcdserverpb::TxnResponse& response, const std::optional<v1::StateRecord>& record);
  absl::Status record_now(const std::optional<v1::StateRecord>& record);
  absl::StatusOr<etcdserverpb::TxnResponse> insist(const etcdserverpb::TxnRequest& request);
  void wait_for_call();
  void take_outcome(const absl::StatusOr<etcdserverpb::TxnResponse>& response);
  void start_next_call();
  void complain(const absl::Status& status);
  void abandon_next();

  Etcd& etcd_;
  const EtcdKeys keys_;
  StateFolder& folder_;
  const Options options_;
  std::optional<StoredWorld> stored_world_;
  std::uint64_t load_ = 0;
  std::uint64_t names_ = 0;                // drawn
  std::optional<v1::StateRecord> record_;  // in etcd
  StateParts parts_;                       // of that state, and of next_
  bool wants_whole_ = true;
  std::int64_t record_revision_ = 0;
  std::uint64_t position_ = 0;
  std::uint64_t stored_ = 0;
  std::vector<v1::StoredInput> waiting_;  // the last inputs, up to position_, of no batch so far
  std::deque<Piece> pieces_;              // of the batch that is on its way
  std::optional<Next> next_;
  // The call that is under way: of next_'s record, or of the first piece.
  std::future<absl::StatusOr<etcdserverpb::TxnResponse>> call_;
  bool is_recording_ = false;
  bool has_complained_ = false;
  bool lost_ = false;
};

}  // namespace tessera
