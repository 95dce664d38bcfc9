// A stream of requests to the coordinator that leads, each of which is carried out once.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/time/time.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "client_sdk/src/coordinators.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Requests are numbered as they are sent. Where the stream is lost, those without a reply are made again,
// under the same numbers, to whoever leads then. Safe to use from any thread.
class RequestSession {
 public:
  using Done = std::function<void(absl::StatusOr<v1::Reply>)>;

  explicit RequestSession(std::shared_ptr<Coordinators> coordinators);
  // What waits for a reply gets CANCELLED.
  ~RequestSession();

  // Waits while kWindow requests have no reply, but not for the network: another thread writes. `done` is
  // called once, on a thread of this object, which it must not hold up: with the reply, or an error: that of
  // the reply, or UNAVAILABLE where nobody was there to take the request again.
  void send(v1::Request request, Done done);

  // DEADLINE_EXCEEDED: no reply in time; the request may take effect nevertheless.
  absl::StatusOr<v1::Reply> call(v1::Request request, absl::Duration timeout);

 private:
  using Stream = grpc::ClientReaderWriter<v1::Request, v1::Reply>;
  static constexpr std::size_t kWindow = 1024;

  struct Pending {
    v1::Request request;
    Done done;
  };

  std::uint64_t enqueue(v1::Request request, Done done);
  void forget(std::uint64_t number);
  void run();
  grpc::Status serve(std::size_t place);
  void send_all();
  bool has_unsent() const { return pending_.upper_bound(written_) != pending_.end(); }
  void send_while_connected();
  void take(v1::Reply reply);
  bool is_worth_another(std::size_t place, const grpc::Status& status);
  bool comes_back(std::size_t place);
  bool is_closing();
  void fail_all(const absl::Status& status);

  const std::shared_ptr<Coordinators> coordinators_;

  std::mutex writing_;  // one writes at a time; before mutex_
  std::mutex mutex_;    // guards the following
  std::condition_variable changed_;
  std::condition_variable writer_wakes_;
  std::map<std::uint64_t, Pending> pending_;  // by number
  std::uint64_t last_number_ = 0;
  std::uint64_t written_ = 0;               // on the present stream, up to this number
  std::vector<std::uint64_t> answered_;     // out of order, since the last request
  Stream* stream_ = nullptr;                // the present one
  grpc::ClientContext* context_ = nullptr;  // of it
  bool has_replied_ = false;                // the coordinator, on it
  bool is_closing_ = false;

  std::thread thread_;
};

}  // namespace tessera
