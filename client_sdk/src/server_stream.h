// One gRPC stream to each server that takes part in a world, merged. Where the world moves to other servers,
// so do the streams; those that leave it end once they have told all.
#pragma once

#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client_sdk/src/stream_merger.h"
#include "keys/keys_folder.h"
#include "proto/server_header.h"
#include "proto/status.h"
#include "tessera.grpc.pb.h"
#include "tessera/stream.h"

namespace tessera {

// `Traits` defines the frame, its batch on the wire, the request and the decoding.
template <typename Traits>
class ServerStreams final : public Stream<typename Traits::Frame> {
 public:
  using Frame = typename Traits::Frame;
  using Request = typename Traits::Request;
  // Asks the coordinator where the world is.
  using AskStatus = std::function<absl::StatusOr<v1::StatusReply>()>;
  // The address of the gateway that the last status came through.
  using Gateway = std::function<std::string()>;

  ServerStreams(Request request, const v1::StatusReply& status, ClientKeys keys, AskStatus ask_status,
                Gateway gateway)
      : request_(std::move(request)),
        load_(status.load()),
        keys_(std::move(keys)),
        ask_status_(std::move(ask_status)),
        gateway_(std::move(gateway)) {
    std::random_device source;
    request_.set_subscription((std::uint64_t{source()} << 32) | source() | 1);
    follow(status);
    follower_ = std::thread([this] { follow_world(); });
  }

  ~ServerStreams() override {
    cancel();
    follower_.join();
    for (const auto& [address, reader] : readers_) reader->thread.join();
  }

  absl::Status wait_for_all(absl::Duration timeout) { return merger_.wait_for_all(timeout); }
  absl::StatusOr<Frame> next(absl::Duration timeout) override { return merger_.next(timeout); }
  std::uint64_t skipped() const override { return merger_.skipped(); }
  void cancel() override { end(absl::CancelledError("the stream was cancelled")); }

 private:
  // How long a coordinator may be missing that has told where the world is before.
  static constexpr std::chrono::seconds kCoordinatorMissedMax{15};
  static constexpr std::chrono::milliseconds kAskAgain{100};
  // What a server that has left the world has yet to send is waited for so long.
  static constexpr std::chrono::seconds kFarewell{5};

  struct Reader {
    grpc::ClientContext context;
    std::unique_ptr<v1::Streams::Stub> stub;
    bool has_ended = false;                                               // guarded by mutex_
    std::optional<std::chrono::steady_clock::time_point> unwanted_since;  // likewise
    std::thread thread;
  };

  void end(absl::Status status) {
    merger_.end(std::move(status));
    const std::lock_guard lock(mutex_);
    ended_ = true;
    for (const auto& [address, reader] : readers_) reader->context.TryCancel();
    changed_.notify_all();
  }

  void look_again() {
    const std::lock_guard lock(mutex_);
    look_again_ = true;
    changed_.notify_all();
  }

  // Opens streams at the servers that take part in the world, and ends those at others.
  void follow(const v1::StatusReply& status) {
    std::map<std::string, std::uint64_t> wanted;  // nodes
    for (const v1::ServerStatus& server : status.servers()) {
      if (server.takes_part()) wanted.emplace(server.stream_address(), server.node());
    }
    std::vector<std::unique_ptr<Reader>> old;
    {
      const std::lock_guard lock(mutex_);
      for (auto reader = readers_.begin(); reader != readers_.end();) {
        const auto here = reader++;
        if (!here->second->has_ended && may_stay(*here->second, wanted.contains(here->first))) continue;
        here->second->context.TryCancel();
        old.push_back(std::move(here->second));
        readers_.erase(here);
      }
      for (const auto& [address, node] : wanted) {
        if (ended_ || readers_.contains(address)) continue;
        readers_.emplace(address, status.through_gateway() ? open(address, gateway_(), node)
                                                           : open(address, address, std::nullopt));
      }
    }
    for (const auto& reader : old) reader->thread.join();
  }

  static bool may_stay(Reader& reader, bool is_wanted) {
    const auto now = std::chrono::steady_clock::now();
    if (is_wanted) {
      reader.unwanted_since.reset();
    } else if (!reader.unwanted_since) {
      reader.unwanted_since = now;
    }
    return is_wanted || now - *reader.unwanted_since < kFarewell;
  }

  // The stream of the server at `address`, over a channel to it, or to a gateway, which is told its node.
  std::unique_ptr<Reader> open(const std::string& address, const std::string& channel,
                               std::optional<std::uint64_t> node) {
    auto reader = std::make_unique<Reader>();
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    reader->stub = v1::Streams::NewStub(keys_.channel(channel, arguments));
    if (node) reader->context.AddMetadata(kServerHeader, absl::StrCat(*node));
    reader->thread = std::thread([this, address, from = reader.get()] { read(address, *from); });
    return reader;
  }

  void read(const std::string& address, Reader& reader) {
    const auto stream = Traits::open(*reader.stub, &reader.context, request_);
    typename Traits::Reader batches(request_);
    typename Traits::Batch batch;
    std::pair<std::uint64_t, Tick> servers;  // epoch, first tick
    std::optional<std::uint64_t> node;
    while (stream->Read(&batch)) {
      absl::StatusOr<Frame> frame = batches.read(batch);
      if (!frame.ok()) {
        end(absl::DataLossError(absl::StrCat("sector server at ", address, ": ", frame.status().message())));
        break;
      }
      const v1::StreamSource& source = batch.source();
      const std::pair<std::uint64_t, Tick> of{source.epoch(), source.since()};
      if (std::exchange(servers, of) != of) look_again();
      node = batch.node();
      const PartOrigin origin{source.load(), source.epoch(), source.servers(), *node, source.since()};
      if (!merger_.push(origin, *std::move(frame), !source.first())) break;
    }
    reader.context.TryCancel();
    const absl::Status why = from_grpc(stream->Finish());
    if (node) merger_.ended(*node);
    if (absl::IsResourceExhausted(why) || absl::IsInvalidArgument(why)) {
      end({why.code(), absl::StrCat("sector server at ", address, ": ", why.message())});
    } else if (merger_.has_ended()) {
      end(why);  // the merger has told the reason
    }
    const std::lock_guard lock(mutex_);
    last_end_ = absl::StrCat("sector server at ", address, ": ",
                             why.ok() ? "it ended the stream" : std::string(why.message()));
    reader.has_ended = true;
    look_again_ = true;
    changed_.notify_all();
  }

  // Wherever the world goes, until the stream ends.
  void follow_world() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return ended_ || look_again_; });
      if (ended_) return;
      look_again_ = false;
      lock.unlock();
      const bool is_followed = look_for_world();
      lock.lock();
      if (is_followed) continue;
      // The world, a server of it, or the coordinator, may be about to come back.
      look_again_ = true;
      changed_.wait_for(lock, kAskAgain, [&] { return ended_; });
    }
  }

  // Whether streams are open at all servers that the world has.
  bool look_for_world() {
    const absl::StatusOr<v1::StatusReply> status = ask_status_();
    const auto now = std::chrono::steady_clock::now();
    if (!status.ok()) {
      if (!missed_since_) missed_since_ = now;
      if (now - *missed_since_ > kCoordinatorMissedMax) end(status.status());
      return false;
    }
    missed_since_.reset();
    if (status->state() == "failed" || status->load() != load_) {
      // The coordinator may know it before the stream of the server that was lost has ended.
      const std::string lost = why_ended();
      end(status->state() == "failed"
              ? absl::UnavailableError(absl::StrCat(lost, lost.empty() ? "" : "; ", status->failure()))
              : absl::AbortedError("the world was unloaded or replaced"));
      return true;
    }
    follow(*status);
    const std::lock_guard lock(mutex_);
    return !readers_.empty() && std::none_of(readers_.begin(), readers_.end(), [](const auto& entry) {
      return entry.second->has_ended || entry.second->unwanted_since;
    });
  }

  std::string why_ended() {
    const std::lock_guard lock(mutex_);
    return last_end_;
  }

  Request request_;
  const std::uint64_t load_;
  const ClientKeys keys_;
  const AskStatus ask_status_;
  const Gateway gateway_;
  StreamMerger<Frame> merger_;
  std::optional<std::chrono::steady_clock::time_point> missed_since_;  // the coordinator; of follower_

  std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  std::map<std::string, std::unique_ptr<Reader>> readers_;  // by address
  std::string last_end_;
  bool look_again_ = false;
  bool ended_ = false;

  std::thread follower_;
};

}  // namespace tessera
