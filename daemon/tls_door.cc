#include "daemon/tls_door.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <list>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/address.h"
#include "transport/descriptor.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kConnectionsMax = 256;  // further ones wait in the queue of the system
constexpr int kWaitingMax = 64;
constexpr std::chrono::seconds kHandshakeMax(5);
constexpr int kLookEveryMs = 1000;  // for handshakes that last
constexpr std::size_t kPieceBytes = 64 << 10;

// Bytes on their way in one direction.
class Pipe {
 public:
  bool empty() const { return sent_ == bytes_; }
  char* free_space() { return buffer_.data(); }
  static constexpr std::size_t size() { return kPieceBytes; }
  void fill(std::size_t bytes) {
    sent_ = 0;
    bytes_ = bytes;
  }
  const char* left() const { return buffer_.data() + sent_; }
  std::size_t bytes_left() const { return bytes_ - sent_; }
  void sent(std::size_t bytes) { sent_ += bytes; }

 private:
  std::vector<char> buffer_ = std::vector<char>(kPieceBytes);
  std::size_t sent_ = 0;
  std::size_t bytes_ = 0;
};

using Tls = std::unique_ptr<SSL, decltype(&SSL_free)>;

// One client, and its connection to the server.
class Relay {
 public:
  Relay(Descriptor client, Tls tls, int server_port)
      : client_(std::move(client)), tls_(std::move(tls)), server_port_(server_port) {}

  // What poll() is to wait for; the server's place is empty before the handshake.
  std::array<pollfd, 2> polled() const {
    short client = to_server_.empty() ? POLLIN : 0;
    if (tls_waits_to_write_) client |= POLLOUT;
    short server = to_client_.empty() ? POLLIN : 0;
    if (!to_server_.empty()) server |= POLLOUT;
    return {{{client_.get(), client, 0}, {server_.get(), server, 0}}};
  }

  // Carries what can be carried now. False when the connection is over.
  bool carry() {
    tls_waits_to_write_ = false;
    if (!server_.is_open()) {
      ERR_clear_error();
      const int done = SSL_accept(tls_.get());
      if (done != 1) return waits(done) && Clock::now() - since_ < kHandshakeMax;
      if (!reach_server()) return false;
    }
    // Each direction until it has to wait.
    for (bool moved = true; moved;) {
      moved = false;
      if (!from_client(moved) || !to_client(moved)) return false;
    }
    return true;
  }

 private:
  // Strangers get no further than the handshake, so no thread of the server waits for them.
  bool reach_server() {
    server_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(server_port_));
    const int yes = 1;
    setsockopt(server_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    return connect(server_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 ||
           errno == EINPROGRESS;
  }

  // Whether TLS only waits for its socket after an operation that returned `result`.
  bool waits(int result) {
    const int error = SSL_get_error(tls_.get(), result);
    if (error == SSL_ERROR_WANT_WRITE) tls_waits_to_write_ = true;
    return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
  }

  // A socket that is not connected yet says ENOTCONN.
  static bool would_block() { return errno == EAGAIN || errno == EINTR || errno == ENOTCONN; }

  bool from_client(bool& moved) {
    if (to_server_.empty()) {
      ERR_clear_error();
      const int got = SSL_read(tls_.get(), to_server_.free_space(), static_cast<int>(Pipe::size()));
      if (got <= 0) return waits(got);
      to_server_.fill(static_cast<std::size_t>(got));
    }
    const ssize_t sent = send(server_.get(), to_server_.left(), to_server_.bytes_left(), MSG_NOSIGNAL);
    if (sent < 0) return would_block();
    to_server_.sent(static_cast<std::size_t>(sent));
    moved = true;
    return true;
  }

  bool to_client(bool& moved) {
    if (to_client_.empty()) {
      const ssize_t got = recv(server_.get(), to_client_.free_space(), Pipe::size(), 0);
      if (got == 0) {
        SSL_shutdown(tls_.get());
        return false;
      }
      if (got < 0) return would_block();
      to_client_.fill(static_cast<std::size_t>(got));
    }
    ERR_clear_error();
    const int sent = SSL_write(tls_.get(), to_client_.left(), static_cast<int>(to_client_.bytes_left()));
    if (sent <= 0) return waits(sent);
    to_client_.sent(static_cast<std::size_t>(sent));
    moved = true;
    return true;
  }

  Descriptor client_;
  Descriptor server_;  // open after the handshake
  Tls tls_;
  const int server_port_;
  Pipe to_server_;
  Pipe to_client_;
  const Clock::time_point since_ = Clock::now();
  bool tls_waits_to_write_ = false;
};

using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;

template <typename Object, typename Read, typename Use>
bool take_pem(const std::string& pem, Read read, void (*free)(Object*), Use use) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> bio(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  const std::unique_ptr<Object, decltype(free)> object(read(bio.get(), nullptr, nullptr, nullptr), free);
  return object != nullptr && use(object.get()) == 1;
}

absl::StatusOr<Context> context_with(const ServerKeys& keys) {
  Context context(SSL_CTX_new(TLS_server_method()), &SSL_CTX_free);
  SSL_CTX* raw = context.get();
  const bool is_ready =
      raw != nullptr && SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION) == 1 &&
      take_pem(keys.certificate, PEM_read_bio_X509, X509_free,
               [raw](X509* certificate) { return SSL_CTX_use_certificate(raw, certificate); }) &&
      take_pem(keys.key, PEM_read_bio_PrivateKey, EVP_PKEY_free,
               [raw](EVP_PKEY* key) { return SSL_CTX_use_PrivateKey(raw, key); }) &&
      SSL_CTX_check_private_key(raw) == 1;
  if (!is_ready) {
    return absl::InvalidArgumentError(
        absl::StrCat(keys.folder.string(), ": certificate and key do not belong together, or are none"));
  }
  SSL_CTX_set_mode(raw, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION);
  return context;
}

absl::StatusOr<Descriptor> listen_on(const std::string& text) {
  const std::optional<ListenAddress> address = parse_listen_address(text);
  if (!address) return absl::InvalidArgumentError(absl::StrCat("'", text, "' is not host:port"));
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error =
          getaddrinfo(address->host.c_str(), absl::StrCat(address->port).c_str(), &hints, &found);
      error != 0) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", text, ": ", gai_strerror(error)));
  }
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  Descriptor listener(socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (!listener.is_open() || bind(listener.get(), found->ai_addr, found->ai_addrlen) != 0 ||
      listen(listener.get(), kWaitingMax) != 0) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", text, ": ", std::strerror(errno)));
  }
  return listener;
}

int port_of(const Descriptor& listener) {
  sockaddr_in6 address{};  // ports of both kinds are at the same place
  socklen_t size = sizeof address;
  getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin6_port);
}

}  // namespace

// One thread carries everything.
class TlsDoor::Impl {
 public:
  Impl(const std::string& address, Descriptor listener, int server_port, Context context)
      : address_(with_port(address, port_of(listener))),
        listener_(std::move(listener)),
        server_port_(server_port),
        context_(std::move(context)),
        end_(eventfd(0, EFD_CLOEXEC)),
        thread_([this] { run(); }) {}
  ~Impl() {
    eventfd_write(end_.get(), 1);
    thread_.join();
  }

  const std::string& address() const { return address_; }

 private:
  void run() {
    // OpenSSL writes to sockets that may have been closed.
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
    std::vector<pollfd> polled;
    for (;;) {
      polled.assign(
          {{end_.get(), POLLIN, 0},
           {listener_.get(), static_cast<short>(relays_.size() < kConnectionsMax ? POLLIN : 0), 0}});
      for (const Relay& relay : relays_) {
        for (const pollfd& one : relay.polled()) polled.push_back(one);
      }
      poll(polled.data(), polled.size(), kLookEveryMs);
      if (polled[0].revents != 0) return;
      const pollfd* sockets = polled.data() + 2;
      relays_.remove_if([&](Relay& relay) {
        const bool is_gone = ((sockets[0].revents | sockets[1].revents) & (POLLERR | POLLHUP)) != 0;
        sockets += 2;
        return !relay.carry() || is_gone;
      });
      if (polled[1].revents != 0) admit();
    }
  }

  void admit() {
    Descriptor client(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!client.is_open()) return;
    const int yes = 1;
    setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    Tls tls(SSL_new(context_.get()), &SSL_free);
    if (!tls || SSL_set_fd(tls.get(), client.get()) != 1) return;
    SSL_set_accept_state(tls.get());
    relays_.emplace_back(std::move(client), std::move(tls), server_port_);
  }

  const std::string address_;
  const Descriptor listener_;
  const int server_port_;
  const Context context_;
  const Descriptor end_;
  std::list<Relay> relays_;  // of the thread
  std::thread thread_;
};

TlsDoor::TlsDoor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TlsDoor::~TlsDoor() = default;

absl::StatusOr<std::unique_ptr<TlsDoor>> TlsDoor::open(const std::string& address, int port,
                                                       const ServerKeys& keys) {
  absl::StatusOr<Context> context = context_with(keys);
  if (!context.ok()) return context.status();
  absl::StatusOr<Descriptor> listener = listen_on(address);
  if (!listener.ok()) return listener.status();
  return std::unique_ptr<TlsDoor>(
      new TlsDoor(std::make_unique<Impl>(address, *std::move(listener), port, *std::move(context))));
}

const std::string& TlsDoor::address() const { return impl_->address(); }

}  // namespace tessera
