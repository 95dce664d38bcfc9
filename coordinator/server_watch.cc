#include "coordinator/server_watch.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <optional>
#include <set>
#include <utility>

namespace tessera {
namespace {

constexpr int kLookAgainMs = 1000;  // for servers that could not be reached

// A connection that is being made, or has been; closed with the object.
class Connection {
 public:
  // Nullopt where the address cannot be found.
  static std::optional<Connection> open(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    if (colon == std::string::npos) return std::nullopt;
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(address.substr(0, colon).c_str(), address.substr(colon + 1).c_str(), &hints, &found) !=
        0) {
      return std::nullopt;
    }
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> release(found, &freeaddrinfo);
    Connection connection(socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (connection.descriptor_ < 0) return std::nullopt;
    if (connect(connection.descriptor_, found->ai_addr, found->ai_addrlen) != 0 && errno != EINPROGRESS) {
      connection.is_refused_ = errno == ECONNREFUSED;
    }
    return connection;
  }
  Connection(Connection&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), is_refused_(other.is_refused_) {}
  Connection& operator=(Connection&&) = delete;
  ~Connection() {
    if (descriptor_ >= 0) close(descriptor_);
  }

  int descriptor() const { return descriptor_; }
  // Whether nobody listens at the address.
  bool is_refused() const {
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size);
    return is_refused_ || error == ECONNREFUSED;
  }

 private:
  explicit Connection(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  bool is_refused_ = false;
};

}  // namespace

ServerWatch::ServerWatch(std::function<void()> wake)
    : wake_(std::move(wake)), event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), thread_([this] { run(); }) {}

ServerWatch::~ServerWatch() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  signal();
  thread_.join();
  close(event_);
}

void ServerWatch::signal() { eventfd_write(event_, 1); }

void ServerWatch::follow(const std::map<NodeId, std::string>& servers) {
  if (servers == followed_) return;
  followed_ = servers;
  {
    const std::lock_guard lock(mutex_);
    wanted_ = servers;
  }
  signal();
}

std::vector<NodeId> ServerWatch::take_ended() {
  const std::lock_guard lock(mutex_);
  return std::exchange(ended_, {});
}

void ServerWatch::run() {
  std::map<NodeId, Connection> connections;
  std::set<NodeId> ended;  // and told
  for (;;) {
    std::map<NodeId, std::string> wanted;
    {
      const std::lock_guard lock(mutex_);
      if (closing_) return;
      wanted = wanted_;
    }
    std::erase_if(connections, [&](const auto& entry) { return !wanted.contains(entry.first); });
    std::erase_if(ended, [&](NodeId node) { return !wanted.contains(node); });
    std::vector<pollfd> polled = {{event_, POLLIN, 0}};
    std::vector<NodeId> nodes;
    for (const auto& [node, address] : wanted) {
      if (ended.contains(node)) continue;
      auto place = connections.find(node);
      if (place == connections.end()) {
        std::optional<Connection> made = Connection::open(address);
        if (!made) continue;
        place = connections.emplace(node, *std::move(made)).first;
      }
      polled.push_back({place->second.descriptor(), POLLRDHUP, 0});
      nodes.push_back(node);
    }
    poll(polled.data(), polled.size(), kLookAgainMs);
    eventfd_t ignored = 0;
    eventfd_read(event_, &ignored);
    bool any = false;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const auto place = connections.find(nodes[n]);
      if (polled[n + 1].revents == 0 && !place->second.is_refused()) continue;
      if (place->second.is_refused()) {
        const std::lock_guard lock(mutex_);
        ended_.push_back(nodes[n]);
        ended.insert(nodes[n]);
        any = true;
      }
      connections.erase(place);  // and is made anew, unless it was refused
    }
    if (any) wake_();
  }
}

}  // namespace tessera
