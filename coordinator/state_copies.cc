#include "coordinator/state_copies.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "proto/disk.h"
#include "proto/whole_file.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

// How often a thread looks whether its standby is gone, and a standby asks again.
constexpr std::chrono::milliseconds kLookAgain{200};
constexpr std::size_t kCoordinatorNameBytesMax = 256;
constexpr std::size_t kHeldMax = 1024;

}  // namespace

void StateCopies::lead(bool leads) {
  const std::lock_guard lock(mutex_);
  leads_ = leads;
  recorded_.clear();
  next_.clear();
  if (!leads) {
    for (const Standby& standby : standbys_) standby.context->TryCancel();
  }
  changed_.notify_all();
}

void StateCopies::offer(std::string recorded, std::string next) {
  const std::lock_guard lock(mutex_);
  recorded_ = std::move(recorded);
  next_ = std::move(next);
  const Clock::time_point now = Clock::now();
  for (Standby& standby : standbys_) standby.progress = now;
  changed_.notify_all();
}

std::optional<std::vector<std::string>> StateCopies::holders(const std::string& name) {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> holders;
  const std::vector<std::string> files = folder_.files_of(name);
  for (const Standby& standby : standbys_) {
    const bool has_all = std::all_of(files.begin(), files.end(),
                                     [&](const std::string& file) { return standby.held.contains(file); });
    if (!files.empty() && has_all) {
      holders.push_back(standby.coordinator);
    } else if (standby.progress + kCopyStallMax > Clock::now()) {
      return std::nullopt;
    } else {
      standby.context->TryCancel();
    }
  }
  return holders;
}

// Waits for a file of a state that this standby lacks; nullopt where it is gone, or this process does not
// lead any more.
std::optional<std::string> StateCopies::next_for(Standby& standby) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (!leads_ || standby.context->IsCancelled()) return std::nullopt;
    for (const std::string& state : {recorded_, next_}) {
      for (std::string& file : folder_.files_of(state)) {
        if (standby.held.contains(file)) continue;
        standby.progress = Clock::now();
        return std::move(file);
      }
    }
    changed_.wait_for(lock, kLookAgain);
  }
}

bool StateCopies::send(const std::string& name, Standby& standby, Stream& stream) {
  v1::StatePiece piece;
  piece.set_name(name);
  const absl::Status status = system_disk().read(folder_.path_of(name), [&](std::string_view bytes) {
    piece.set_bytes(std::string(bytes));
    if (!stream.Write(piece)) return absl::UnavailableError("the standby is gone");
    const std::lock_guard lock(mutex_);
    standby.progress = Clock::now();
    return absl::OkStatus();
  });
  // A file that is gone was replaced by a later one.
  if (!status.ok()) return false;
  piece.clear_bytes();
  piece.set_is_last(true);
  return stream.Write(piece);
}

grpc::Status StateCopies::CopyStates(grpc::ServerContext* context, Stream* stream) {
  v1::StatesHeld held;
  if (!stream->Read(&held)) return grpc::Status::CANCELLED;
  std::list<Standby>::iterator standby;
  {
    const std::lock_guard lock(mutex_);
    if (!leads_) return {grpc::StatusCode::UNAVAILABLE, "this coordinator does not lead"};
    if (standbys_.size() >= kStandbysMax)
      return {grpc::StatusCode::RESOURCE_EXHAUSTED,
              absl::StrCat("there are ", kStandbysMax, " standbys already")};
    if (held.coordinator().size() > kCoordinatorNameBytesMax)
      return {grpc::StatusCode::INVALID_ARGUMENT, "the name of the coordinator is too long"};
    standby = standbys_.insert(standbys_.end(), {context, held.coordinator(), {}, Clock::now()});
  }
  const absl::Cleanup leave = [&] {
    {
      const std::lock_guard lock(mutex_);
      standbys_.erase(standby);
    }
    wake_();
  };
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (static_cast<std::size_t>(held.names_size()) > kHeldMax)
        return {grpc::StatusCode::INVALID_ARGUMENT, "too many states"};
      standby->held.clear();
      standby->held.insert(held.names().begin(), held.names().end());
      standby->progress = Clock::now();
    }
    wake_();
    const std::optional<std::string> name = next_for(*standby);
    if (!name || !send(*name, *standby, *stream) || !stream->Read(&held)) return grpc::Status::OK;
  }
}

StateFollower::~StateFollower() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    if (call_ != nullptr) call_->TryCancel();
  }
  changed_.notify_all();
  thread_.join();
}

void StateFollower::follow(const std::string& leader) {
  const std::lock_guard lock(mutex_);
  if (leader == leader_) return;
  leader_ = leader;
  if (call_ != nullptr) call_->TryCancel();
  changed_.notify_all();
}

void StateFollower::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    changed_.wait(lock, [&] { return closing_ || !leader_.empty(); });
    if (closing_) return;
    const std::string leader = leader_;
    lock.unlock();
    copy_from(leader);
    lock.lock();
    changed_.wait_for(lock, kLookAgain, [&] { return closing_ || leader_ != leader; });
  }
}

void StateFollower::copy_from(const std::string& leader) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  const auto stub = v1::Coordination::NewStub(keys_.channel(leader, arguments));
  grpc::ClientContext context;
  {
    const std::lock_guard lock(mutex_);
    if (closing_ || leader_ != leader) return;
    call_ = &context;
  }
  const auto stream = stub->CopyStates(&context);
  v1::StatesHeld held;
  held.set_coordinator(folder_.coordinator());
  do {
    held.clear_names();
    for (const std::string& name : folder_.files()) held.add_names(name);
  } while (stream->Write(held) && take(*stream, leader));
  context.TryCancel();
  static_cast<void>(stream->Finish());
  const std::lock_guard lock(mutex_);
  call_ = nullptr;
}

// One file of a state. False where the leader, or this one, has no more to do with the other.
bool StateFollower::take(grpc::ClientReaderWriter<v1::StatesHeld, v1::StatePiece>& stream,
                         const std::string& leader) {
  v1::StatePiece piece;
  if (!stream.Read(&piece) || !is_state_name(piece.name())) return false;
  const std::string name = piece.name();
  absl::StatusOr<WholeFile> file = folder_.create(name);
  if (!file.ok()) return false;
  while (!piece.is_last()) {
    if (!file->append(piece.bytes()).ok() || !stream.Read(&piece) || piece.name() != name) return false;
  }
  {
    // Whoever leads meanwhile has the folder for itself.
    const std::lock_guard lock(mutex_);
    if (closing_ || leader_ != leader) return false;
  }
  if (!file->finish().ok()) return false;
  folder_.add(name);
  return true;
}

}  // namespace tessera
