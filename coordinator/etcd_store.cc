#include "coordinator/etcd_store.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "coordinator/state_copies.h"

namespace tessera {
namespace {

using etcdserverpb::KeyValue;
using etcdserverpb::TxnRequest;
using etcdserverpb::TxnResponse;

constexpr std::chrono::milliseconds kAskStandbysAgain{10};

std::string digits(std::uint64_t number) { return absl::StrCat(absl::Hex(number, absl::kZeroPad16)); }

const absl::Status& not_leading() {
  static const absl::Status kStatus =
      absl::AbortedError("another coordinator leads: this may have taken effect or not");
  return kStatus;
}

template <typename T>
bool is_ready(const std::future<T>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

absl::StatusOr<std::unique_ptr<EtcdStore>> EtcdStore::open(Etcd& etcd, const EtcdKeys& keys,
                                                           StateFolder& folder, Options options) {
  std::unique_ptr<EtcdStore> store(new EtcdStore(etcd, keys, folder, std::move(options)));
  if (absl::Status status = store->read_all(); !status.ok()) return status;
  return store;
}

EtcdStore::~EtcdStore() { abandon_next(); }

absl::Status EtcdStore::read_all() {
  TxnRequest request = guarded();
  *request.add_success() = read(keys_.state);
  const absl::StatusOr<TxnResponse> response = insist(request);
  if (!response.ok()) return response.status();
  StoredWorld world;
  if (const KeyValue* state = only_key(response->responses(0)); state != nullptr) {
    v1::StateRecord record;
    if (!record.ParseFromString(state->value()))
      return absl::DataLossError(absl::StrCat("key ", keys_.state, " of etcd is not as it was written"));
    absl::StatusOr<StoredState> stored = folder_.read(record.name());
    if (!stored.ok()) return stored.status();
    world.state = *std::move(stored);
    world.load = load_ = record.load();
    position_ = stored_ = record.position();
    record_revision_ = state->mod_revision();
    record_ = std::move(record);
  }
  if (absl::Status status = read_inputs(world); !status.ok()) return status;
  if (record_) {
    folder_.drop_before(record_->name());
    options_.copies.offer(record_->name(), {});
    stored_world_ = std::move(world);
  }
  return absl::OkStatus();
}

// A batch whose last pieces are missing was never acknowledged: it is removed, like all that the state has.
absl::Status EtcdStore::read_inputs(StoredWorld& world) {
  std::string from = keys_.inputs;
  std::string bytes;
  std::uint32_t pieces = 0;
  for (bool more = true; more;) {
    TxnRequest request = guarded();
    *request.add_success() = read(from, end_of(keys_.inputs), kEtcdKeysPerRead);
    const absl::StatusOr<TxnResponse> response = insist(request);
    if (!response.ok()) return response.status();
    const etcdserverpb::RangeResponse& range = response->responses(0).response_range();
    more = range.more() && !range.kvs().empty();
    for (const KeyValue& entry : range.kvs()) {
      from = entry.key() + '\0';
      v1::InputPiece piece;
      if (!piece.ParseFromString(entry.value()))
        return absl::DataLossError(absl::StrCat("key ", entry.key(), " of etcd is not as it was written"));
      if (piece.last() <= stored_) continue;
      bytes += piece.bytes();
      if (++pieces < piece.pieces()) continue;
      v1::InputBatch batch;
      if (!batch.ParseFromString(bytes) || piece.first() > stored_ + 1)
        return absl::DataLossError(absl::StrCat("key ", entry.key(), " of etcd is not as it was written"));
      for (std::uint64_t at = piece.first(); v1::StoredInput & input : *batch.mutable_inputs()) {
        if (at++ > stored_) world.inputs.push_back(std::move(input));
      }
      position_ = stored_ = piece.last();
      bytes.clear();
      pieces = 0;
    }
  }
  TxnRequest clean = guarded();
  *clean.add_success() = erase(keys_.inputs, input_key(record_ ? record_->position() + 1 : 0));
  *clean.add_success() = erase(input_key(position_ + 1), end_of(keys_.inputs));
  return insist(clean).status();
}

absl::Status EtcdStore::begin(std::uint64_t load, const StoredState& state) {
  abandon_next();
  wait_for_call();
  load_ = load;
  const std::string name = draw_name();
  if (absl::Status status = folder_.write(name, state); !status.ok()) return status;
  wants_whole_ = true;
  options_.copies.offer(record_ ? record_->name() : std::string(), name);
  const auto deadline = std::chrono::steady_clock::now() + kFirstCopyMax;
  while (!options_.copies.holders(name) && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(kAskStandbysAgain);
  return record_now(record_of(name, position_));
}

absl::Status EtcdStore::end() {
  abandon_next();
  wait_for_call();
  return record_now(std::nullopt);
}

absl::Status EtcdStore::append(const std::vector<v1::StoredInput>& inputs) {
  waiting_.insert(waiting_.end(), inputs.begin(), inputs.end());
  position_ += inputs.size();
  return tend();
}

bool EtcdStore::change(StateChange change, std::uint64_t position) {
  if (next_ || lost_) return false;
  const std::string name = draw_name();
  StatePart part = parts_.add(name, change);
  wants_whole_ = false;
  next_.emplace();
  next_->record = record_of(name, position);
  next_->writing = std::async(std::launch::async, [this, part = std::move(part), change = std::move(change)] {
    return folder_.write_change(part, change);
  });
  return true;
}

absl::Status EtcdStore::tend() {
  if (lost_) return absl::OkStatus();
  if (call_.valid()) {
    if (!is_ready(call_)) return absl::OkStatus();
    take_outcome(call_.get());
  }
  if (!lost_) start_next_call();
  return absl::OkStatus();
}

void EtcdStore::start_next_call() {
  is_recording_ = is_next_held();
  if (is_recording_) {
    call_ = etcd_.transact(recording(next_->record));
    return;
  }
  if (pieces_.empty()) make_pieces();
  if (pieces_.empty()) return;
  TxnRequest request = guarded();
  *request.add_success() = pieces_.front().put;
  call_ = etcd_.transact(std::move(request));
}

// After an error the same is asked again: it makes no difference whether it has taken effect before.
void EtcdStore::take_outcome(const absl::StatusOr<TxnResponse>& response) {
  if (!response.ok()) return complain(response.status());
  has_complained_ = false;
  if (is_recording_) {
    if (!is_recorded(*response, next_->record)) return;
    next_.reset();
    return;
  }
  lost_ = !response->succeeded();
  if (lost_) return;
  if (pieces_.front().stored != 0) stored_ = std::max(stored_, pieces_.front().stored);
  pieces_.pop_front();
}

// Whether the next state is on the disks of all that are to have it. One that cannot be written is given up.
bool EtcdStore::is_next_held() {
  if (!next_) return false;
  if (next_->writing.valid()) {
    if (!is_ready(next_->writing)) return false;
    if (absl::Status written = next_->writing.get(); !written.ok()) {
      complain(written);
      wants_whole_ = true;
      next_.reset();
      return false;
    }
    next_->after = position_;
    next_->offered = std::chrono::steady_clock::now();
    options_.copies.offer(record_ ? record_->name() : std::string(), next_->record.name());
  }
  if (stored_ < next_->after) return false;
  if (!options_.copies.holders(next_->record.name())) {
    if (std::chrono::steady_clock::now() < next_->offered + kCopiesMax) return false;
    if (options_.warn) options_.warn("a standby does not get the state of the world, and is not waited for");
  }
  next_->record = record_of(next_->record.name(), next_->record.position());
  return true;
}

// Of as many inputs as fit into one value, or of one that does not.
void EtcdStore::make_pieces() {
  if (waiting_.empty()) return;
  v1::InputBatch batch;
  std::size_t bytes = 0;
  auto input = waiting_.begin();
  do {
    bytes += input->ByteSizeLong();
    *batch.add_inputs() = std::move(*input++);
  } while (input != waiting_.end() && bytes + input->ByteSizeLong() < kEtcdValueBytesMax);
  waiting_.erase(waiting_.begin(), input);
  const std::uint64_t last = position_ - waiting_.size();
  const std::string all = batch.SerializeAsString();
  v1::InputPiece piece;
  piece.set_first(last + 1 - static_cast<std::uint64_t>(batch.inputs_size()));
  piece.set_last(last);
  piece.set_pieces(static_cast<std::uint32_t>(
      std::max<std::size_t>((all.size() + kEtcdValueBytesMax - 1) / kEtcdValueBytesMax, 1)));
  for (std::uint32_t n = 0; n < piece.pieces(); ++n) {
    piece.set_bytes(all.substr(n * kEtcdValueBytesMax, kEtcdValueBytesMax));
    pieces_.push_back({put(absl::StrCat(input_key(last), "-", digits(n)), piece.SerializeAsString()),
                       n + 1 == piece.pieces() ? last : 0});
  }
}

std::string EtcdStore::input_key(std::uint64_t last) const {
  return absl::StrCat(keys_.inputs, digits(last));
}

std::string EtcdStore::draw_name() {
  return absl::StrCat(digits(static_cast<std::uint64_t>(options_.epoch)), "-", digits(++names_));
}

v1::StateRecord EtcdStore::record_of(std::string name, std::uint64_t position) const {
  v1::StateRecord record;
  record.add_holders(folder_.coordinator());
  if (const auto holders = options_.copies.holders(name)) {
    for (const std::string& holder : *holders) record.add_holders(holder);
  }
  record.set_name(std::move(name));
  record.set_load(load_);
  record.set_position(position);
  return record;
}

// Happens only while this coordinator leads.
TxnRequest EtcdStore::guarded() const {
  TxnRequest request;
  *request.add_compare() = created_at(keys_.leader, options_.epoch);
  return request;
}

// One that comes late, when another has been recorded since, has no effect.
TxnRequest EtcdStore::recording(const std::optional<v1::StateRecord>& record) const {
  TxnRequest request = guarded();
  *request.add_compare() = changed_at(keys_.state, record_revision_);
  *request.add_success() = record ? put(keys_.state, record->SerializeAsString()) : erase(keys_.state);
  *request.add_success() =
      erase(keys_.inputs, record ? input_key(record->position() + 1) : end_of(keys_.inputs));
  *request.add_failure() = read(keys_.leader);
  *request.add_failure() = read(keys_.state);
  return request;
}

// Where the conditions did not hold, an earlier try, which seemed to fail, has recorded this or another
// state.
bool EtcdStore::is_recorded(const TxnResponse& response, const std::optional<v1::StateRecord>& record) {
  bool is_there = response.succeeded();
  std::int64_t revision = response.header().revision();
  if (!is_there) {
    const KeyValue* leader = only_key(response.responses(0));
    const KeyValue* state = only_key(response.responses(1));
    lost_ = leader == nullptr || leader->create_revision() != options_.epoch;
    v1::StateRecord found;
    if (state != nullptr) found.ParseFromString(state->value());
    revision = state != nullptr ? state->mod_revision() : 0;
    is_there = !lost_ && (record ? found.name() == record->name() : state == nullptr);
  }
  if (lost_) return false;
  record_revision_ = is_there && !record ? 0 : revision;
  if (!is_there) return false;
  record_ = record;
  if (record_) folder_.drop_before(record_->name());
  options_.copies.offer(record_ ? record_->name() : std::string(), {});
  return true;
}

// Whatever is under way for the world before is void.
absl::Status EtcdStore::record_now(const std::optional<v1::StateRecord>& record) {
  pieces_.clear();
  waiting_.clear();
  while (!lost_) {
    const absl::StatusOr<TxnResponse> response = insist(recording(record));
    if (!response.ok()) return response.status();
    if (!is_recorded(*response, record)) continue;
    stored_ = position_;
    return absl::OkStatus();
  }
  return not_leading();
}

// Until it succeeds, or this coordinator leads no more. A request whose conditions do not hold has succeeded
// unless it has nothing to do in that case.
absl::StatusOr<TxnResponse> EtcdStore::insist(const TxnRequest& request) {
  while (options_.leads()) {
    absl::StatusOr<TxnResponse> response = etcd_.transact(request).get();
    if (!response.ok()) {
      complain(response.status());
      continue;
    }
    if (response->succeeded() || !request.failure().empty()) return response;
    break;
  }
  lost_ = true;
  return not_leading();
}

void EtcdStore::wait_for_call() {
  if (call_.valid()) take_outcome(call_.get());
}

// Once, until there is an answer again.
void EtcdStore::complain(const absl::Status& status) {
  if (std::exchange(has_complained_, true) || !options_.warn) return;
  options_.warn(absl::StrCat("the world waits for its store: ", status.message()));
}

void EtcdStore::abandon_next() {
  if (next_ && next_->writing.valid()) next_->writing.wait();
  // What was asked for may still be recorded: the next record is made under the condition that it is not.
  if (is_recording_) wait_for_call();
  next_.reset();
}

}  // namespace tessera
