#include "daemon/http_door.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <list>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/door_relay.h"
#include "daemon/door_socket.h"
#include "daemon/listener.h"
#include "transport/descriptor.h"

namespace tessera {
namespace {

constexpr int kLookEveryMs = 500;  // for clients that are late

struct Visit {
  std::string host;
  DoorRelay relay;
};

}  // namespace

// One thread carries everything.
class HttpDoor::Impl {
 public:
  Impl(Listener listener, int server_port, TlsContext context)
      : listener_(std::move(listener)),
        server_port_(server_port),
        context_(std::move(context)),
        end_(eventfd(0, EFD_CLOEXEC)),
        thread_([this] { run(); }) {}
  ~Impl() {
    eventfd_write(end_.get(), 1);
    thread_.join();
  }

  const std::string& address() const { return listener_.address(); }

 private:
  void run() {
    // OpenSSL writes to sockets that may have been closed.
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
    std::vector<pollfd> polled;
    for (;;) {
      polled.assign({{end_.get(), POLLIN, 0}});
      for (const Descriptor& socket : listener_.sockets()) {
        polled.push_back({socket.get(), static_cast<short>(deaf_ ? 0 : POLLIN), 0});
      }
      deaf_ = false;
      for (const Visit& visit : visits_) {
        for (const pollfd& one : visit.relay.polled()) polled.push_back(one);
      }
      poll(polled.data(), polled.size(), kLookEveryMs);
      if (polled[0].revents != 0) return;
      carry(polled.data() + 1 + listener_.sockets().size());
      for (const Descriptor& socket : listener_.sockets()) admit(socket);
    }
  }

  void carry(const pollfd* sockets) {
    std::size_t served = count_if([](const Visit& visit) { return visit.relay.is_served(); });
    visits_.remove_if([&](Visit& visit) {
      const bool is_gone = ((sockets[0].revents | sockets[1].revents) & (POLLERR | POLLHUP)) != 0;
      sockets += 2;
      const bool was_served = visit.relay.is_served();
      const bool goes_on = visit.relay.carry(served < kServedClientsMax);
      if (!was_served && visit.relay.is_served()) ++served;
      return !goes_on || is_gone;
    });
  }

  void admit(const Descriptor& listening) {
    for (int accepted = 0; accepted < kAcceptedAtOnceMax && !deaf_; ++accepted) {
      Visitor visitor = Listener::accept(listening);
      if (!visitor.socket.is_open()) {
        // Without descriptors, whoever waits has to go on waiting.
        deaf_ = Listener::is_shortage(errno);
        return;
      }
      make_room_for(visitor.host);
      DoorSocket client(std::move(visitor.socket), context_.get());
      visits_.push_back({std::move(visitor.host), DoorRelay(std::move(client), server_port_)});
    }
  }

  template <typename Has>
  std::size_t count_if(const Has& has) const {
    return static_cast<std::size_t>(std::count_if(visits_.begin(), visits_.end(), has));
  }

  // Who has sent nothing has no place that somebody else could need.
  void make_room_for(const std::string& host) {
    const auto waits = [](const Visit& visit) { return !visit.relay.is_served(); };
    const auto waits_too = [&](const Visit& visit) { return waits(visit) && visit.host == host; };
    if (count_if(waits_too) >= kWaitingClientsPerHostMax) {
      visits_.erase(std::find_if(visits_.begin(), visits_.end(), waits_too));
    } else if (count_if(waits) >= kWaitingClientsMax) {
      visits_.erase(std::find_if(visits_.begin(), visits_.end(), waits));
    }
  }

  const Listener listener_;
  const int server_port_;
  const TlsContext context_;  // null: without TLS
  const Descriptor end_;
  std::list<Visit> visits_;  // the oldest first; of the thread
  bool deaf_ = false;        // for a turn; likewise
  std::thread thread_;
};

HttpDoor::HttpDoor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HttpDoor::~HttpDoor() = default;

absl::StatusOr<std::unique_ptr<HttpDoor>> HttpDoor::open(const std::string& address, int port,
                                                         const std::optional<ServerKeys>& keys) {
  TlsContext context(nullptr, &SSL_CTX_free);
  if (keys) {
    absl::StatusOr<TlsContext> of_keys = tls_context_with(*keys);
    if (!of_keys.ok()) return of_keys.status();
    context = *std::move(of_keys);
  }
  absl::StatusOr<Listener> listener = Listener::open(address);
  if (!listener.ok()) return listener.status();
  return std::unique_ptr<HttpDoor>(
      new HttpDoor(std::make_unique<Impl>(*std::move(listener), port, std::move(context))));
}

const std::string& HttpDoor::address() const { return impl_->address(); }

}  // namespace tessera
