#include "daemon/grpc_door.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/listener.h"
#include "transport/descriptor.h"

namespace tessera {
namespace {

using Acceptor = grpc::experimental::ExternalConnectionAcceptor;
using Clock = std::chrono::steady_clock;

constexpr int kShortageMs = 100;  // until it is tried again
constexpr std::chrono::milliseconds kCountEvery(20);

// A connection that gRPC has. It closes the socket; the descriptor may then be that of another file.
struct Connection {
  int descriptor = -1;
  ino_t file = 0;
  std::string host;
};

std::optional<ino_t> file_of(int descriptor) {
  struct stat found {};
  if (fstat(descriptor, &found) != 0) return std::nullopt;
  return found.st_ino;
}

}  // namespace

std::size_t client_connections_max(std::size_t open_files_max) {
  return std::min(kClientConnectionsMax, open_files_max - std::min(kOwnFilesMax, open_files_max / 2));
}

// One thread accepts.
class GrpcDoor::Impl {
 public:
  Impl(Listener listener, std::size_t connections_max, std::unique_ptr<Acceptor> acceptor)
      : listener_(std::move(listener)),
        connections_max_(connections_max),
        acceptor_(std::move(acceptor)),
        end_(eventfd(0, EFD_CLOEXEC)) {}
  ~Impl() {
    eventfd_write(end_.get(), 1);
    if (thread_.joinable()) thread_.join();
  }

  const std::string& address() const { return listener_.address(); }
  void let_in() {
    thread_ = std::thread([this] { run(); });
  }

 private:
  void run() {
    std::vector<pollfd> polled;
    for (;;) {
      polled.assign({{end_.get(), POLLIN, 0}});
      for (const Descriptor& socket : listener_.sockets()) {
        polled.push_back({socket.get(), static_cast<short>(is_short_ ? 0 : POLLIN), 0});
      }
      poll(polled.data(), polled.size(), is_short_ ? kShortageMs : -1);
      if (polled.front().revents != 0) return;
      is_short_ = false;
      for (const Descriptor& socket : listener_.sockets()) admit(socket);
    }
  }

  void admit(const Descriptor& listening) {
    for (int accepted = 0; accepted < kAcceptedAtOnceMax && !is_short_; ++accepted) {
      Visitor visitor = Listener::accept(listening);
      if (!visitor.socket.is_open()) {
        is_short_ = Listener::is_shortage(errno);
        return;
      }
      const std::optional<ino_t> file = file_of(visitor.socket.get());
      if (!file || !has_room_for(visitor.host)) continue;
      Acceptor::NewConnectionParameters connection;
      connection.listener_fd = listening.get();
      connection.fd = visitor.socket.release();
      connections_.push_back({connection.fd, *file, std::move(visitor.host)});
      acceptor_->HandleNewConnection(&connection);
    }
  }

  bool has_room_for(const std::string& host) {
    if (fits(host)) return true;
    // Whoever knocks again and again does not have them counted each time.
    if (Clock::now() - counted_ < kCountEvery) return false;
    counted_ = Clock::now();
    std::erase_if(connections_, [](const Connection& one) { return file_of(one.descriptor) != one.file; });
    return fits(host);
  }
  bool fits(const std::string& host) const {
    if (connections_.size() >= connections_max_) return false;
    const auto of_host =
        std::ranges::count_if(connections_, [&](const Connection& one) { return one.host == host; });
    return static_cast<std::size_t>(of_host) < (connections_max_ + 1) / 2;
  }

  const Listener listener_;
  const std::size_t connections_max_;
  const std::unique_ptr<Acceptor> acceptor_;
  const Descriptor end_;
  // Of the thread:
  std::vector<Connection> connections_;  // some may have ended since they were counted
  Clock::time_point counted_;
  bool is_short_ = false;  // of descriptors
  std::thread thread_;
};

GrpcDoor::GrpcDoor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GrpcDoor::~GrpcDoor() = default;

absl::StatusOr<std::unique_ptr<GrpcDoor>> GrpcDoor::open(const std::string& address,
                                                         const std::optional<ServerKeys>& keys,
                                                         std::size_t connections_max,
                                                         grpc::ServerBuilder& builder) {
  absl::StatusOr<Listener> listener = Listener::open(address);
  if (!listener.ok()) return listener.status();
  auto acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, server_credentials(keys));
  return std::unique_ptr<GrpcDoor>(
      new GrpcDoor(std::make_unique<Impl>(*std::move(listener), connections_max, std::move(acceptor))));
}

const std::string& GrpcDoor::address() const { return impl_->address(); }
void GrpcDoor::let_in() { impl_->let_in(); }

}  // namespace tessera
