#include "coordinator/snapshot_calls.h"

#include <absl/strings/str_cat.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "coordinator/call_place.h"
#include "coordinator/limits.h"
#include "proto/snapshot_file.h"
#include "proto/status.h"

namespace tessera {
namespace {

// Room for one of the calls that hold a whole world.
class Turn {
 public:
  explicit Turn(std::atomic<int>& calls)
      : calls_(calls), is_taken_(calls_.fetch_add(1) < kSnapshotCallsMax) {}
  ~Turn() { end(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  bool is_taken() const { return is_taken_; }

  // Before the call is answered, so that its client can make the next one at once.
  void end() {
    if (!std::exchange(has_ended_, true)) calls_.fetch_sub(1);
  }

 private:
  std::atomic<int>& calls_;
  const bool is_taken_;
  bool has_ended_ = false;
};

absl::Status too_many_snapshots() {
  return absl::ResourceExhaustedError(absl::StrCat(
      kSnapshotCallsMax, " snapshots are being taken or restored, and no more may: ask again later"));
}

class SnapshotCall final : public grpc::ServerWriteReactor<v1::SnapshotPiece> {
 public:
  SnapshotCall(RequestQueue& queue, std::atomic<int>& calls) : turn_(calls) {
    ClientRequest posted(ClientCall<v1::SnapshotRequest, SnapshotChunks>{
        {}, [place = place_](const absl::Status& status, const SnapshotChunks& chunks) {
          if (SnapshotCall* call = place->take()) call->write(status, chunks);
        }});
    const absl::Status pushed = turn_.is_taken() ? queue.push(posted, 0) : too_many_snapshots();
    if (!pushed.ok() && place_->take() != nullptr) finish(to_grpc(pushed));
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return finish(client_is_gone());
    write_next();
  }
  // A write that is under way ends by itself.
  void OnCancel() override {
    if (place_->take() != nullptr) finish(client_is_gone());
  }
  void OnDone() override { delete this; }

 private:
  void finish(const grpc::Status& status) {
    turn_.end();
    Finish(status);
  }

  void write(const absl::Status& status, const SnapshotChunks& chunks) {
    if (!status.ok()) return finish(to_grpc(status));
    chunks_ = chunks;
    piece_.set_tick(chunks_.front().head().tick());
    write_next();
  }

  void write_next() {
    if (written_ == chunks_.size()) return finish(grpc::Status::OK);
    absl::StatusOr<std::string> bytes = encoder_.encode(chunks_[written_]);
    if (!bytes.ok()) return finish(to_grpc(bytes.status()));
    chunks_[written_++].Clear();
    piece_.set_bytes(*std::move(bytes));
    StartWrite(&piece_);
  }

  Turn turn_;
  std::shared_ptr<CallPlace<SnapshotCall>> place_ = std::make_shared<CallPlace<SnapshotCall>>(this);
  SnapshotChunks chunks_;  // at least a head and an end
  std::size_t written_ = 0;
  SnapshotEncoder encoder_;
  v1::SnapshotPiece piece_;
};

class RestoreCall final : public grpc::ServerReadReactor<v1::RestoreRequest> {
 public:
  RestoreCall(RequestQueue& queue, std::atomic<int>& calls, v1::LoadReply* answer)
      : turn_(calls), queue_(queue), answer_(answer) {
    if (turn_.is_taken()) {
      StartRead(&message_);
    } else {
      end(to_grpc(too_many_snapshots()));
    }
  }

  void OnReadDone(bool ok) override {
    if (!ok) return post();
    bytes_ += message_.bytes().size();
    if (bytes_ > kSnapshotBytesMax) {
      return end({grpc::StatusCode::RESOURCE_EXHAUSTED,
                  absl::StrCat("a snapshot may have at most ", kSnapshotBytesMax, " bytes")});
    }
    if (is_first_) {
      restored_.replace = message_.replace();
      restored_.replay = message_.replay();
    }
    is_first_ = false;
    if (absl::Status status = decoder_.add(message_.bytes()); !status.ok()) return end(to_grpc(status));
    StartRead(&message_);
  }
  void OnCancel() override { end(client_is_gone()); }
  void OnDone() override { delete this; }

 private:
  void finish(const grpc::Status& status) {
    turn_.end();
    Finish(status);
  }

  void end(const grpc::Status& status) {
    if (place_->take() != nullptr) finish(status);
  }

  void post() {
    absl::StatusOr<SnapshotChunks> chunks = decoder_.finish();
    if (!chunks.ok()) return end(to_grpc(chunks.status()));
    restored_.chunks = *std::move(chunks);
    ClientRequest posted(ClientCall<RestoreChunks, v1::LoadReply>{
        std::move(restored_), [place = place_](const absl::Status& status, const v1::LoadReply& reply) {
          RestoreCall* call = place->take();
          if (call == nullptr) return;
          *call->answer_ = reply;
          call->finish(to_grpc(status));
        }});
    if (absl::Status pushed = queue_.push(posted, 0); !pushed.ok()) end(to_grpc(pushed));
  }

  Turn turn_;
  RequestQueue& queue_;
  v1::LoadReply* answer_;
  std::shared_ptr<CallPlace<RestoreCall>> place_ = std::make_shared<CallPlace<RestoreCall>>(this);
  v1::RestoreRequest message_;
  SnapshotDecoder decoder_;
  RestoreChunks restored_;
  bool is_first_ = true;
  std::size_t bytes_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::SnapshotPiece>* start_snapshot(RequestQueue& queue, std::atomic<int>& calls) {
  return std::make_unique<SnapshotCall>(queue, calls).release();
}

grpc::ServerReadReactor<v1::RestoreRequest>* start_restore(RequestQueue& queue, std::atomic<int>& calls,
                                                           v1::LoadReply* answer) {
  return std::make_unique<RestoreCall>(queue, calls, answer).release();
}

}  // namespace tessera
