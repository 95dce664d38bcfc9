// How states of the world get from the coordinator that leads to those that stand by.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "coordinator/state_folder.h"
#include "keys/keys_folder.h"
#include "standby.grpc.pb.h"

namespace tessera {

// Of the leader: sends the states that it offers to every standby that asks, and knows who has them.
// Safe to use from any thread.
class StateCopies final : public v1::Coordination::Service {
 public:
  // `wake` is called on a thread of its own when a standby has come to hold a state, or is gone.
  StateCopies(const StateFolder& folder, std::function<void()> wake)
      : folder_(folder), wake_(std::move(wake)) {}

  // From now on, this process leads or stands by: only leaders are asked.
  void lead(bool leads);

  // Offers the state that etcd names (empty: there is none), and one that is to take its place (likewise).
  void offer(std::string recorded, std::string next);

  // The standbys that have `name`; nullopt while another is yet to get it. One that makes no progress for
  // kCopyStallMax is not waited for.
  std::optional<std::vector<std::string>> holders(const std::string& name);

  grpc::Status CopyStates(grpc::ServerContext* context,
                          grpc::ServerReaderWriter<v1::StatePiece, v1::StatesHeld>* stream) override;

 private:
  struct Standby {
    grpc::ServerContext* context = nullptr;
    std::string coordinator;
    std::set<std::string> held;
    std::chrono::steady_clock::time_point progress;
  };
  using Stream = grpc::ServerReaderWriter<v1::StatePiece, v1::StatesHeld>;

  std::optional<std::string> next_for(Standby& standby);
  bool send(const std::string& name, Standby& standby, Stream& stream);

  const StateFolder& folder_;
  const std::function<void()> wake_;
  std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  bool leads_ = false;
  std::string recorded_;
  std::string next_;
  std::list<Standby> standbys_;
};

// Of a standby: takes the states of the leader into its folder.
class StateFollower {
 public:
  // `keys` are those of a daemon; none where coordinators have none.
  explicit StateFollower(StateFolder& folder, ClientKeys keys = {})
      : folder_(folder), keys_(std::move(keys)), thread_([this] { run(); }) {}
  ~StateFollower();

  // Whom to ask from now on; empty: nobody.
  void follow(const std::string& leader);

 private:
  void run();
  void copy_from(const std::string& leader);
  bool take(grpc::ClientReaderWriter<v1::StatesHeld, v1::StatePiece>& stream, const std::string& leader);

  StateFolder& folder_;
  const ClientKeys keys_;
  std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  std::string leader_;
  grpc::ClientContext* call_ = nullptr;
  bool closing_ = false;
  std::thread thread_;
};

inline constexpr std::chrono::seconds kCopyStallMax{10};
inline constexpr std::size_t kStandbysMax = 8;
// What keeps failing at a standby does not keep the leader from recording states for longer.
inline constexpr std::chrono::seconds kCopiesMax{60};
// A load waits for the copies of its world at the standbys so long; then it goes on without.
inline constexpr std::chrono::seconds kFirstCopyMax{5};

}  // namespace tessera
