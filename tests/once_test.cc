// Commands whose answer is lost run once: a client behind a connection that breaks at the worst moment.
#include <absl/strings/str_cat.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

#include "daemon/address.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

// Passes on what client and server say, one connection at a time. Once it holds answers, it passes on only
// what the client says, until it is cut.
class Wire {
 public:
  explicit Wire(const std::string& server) : server_(parse_listen_address(server).value().port) {
    listener_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address = on_loopback(0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 8), 0);
    socklen_t size = sizeof address;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    address_ = absl::StrCat("127.0.0.1:", ntohs(address.sin_port));
    thread_ = std::thread([this] { run(); });
  }
  ~Wire() {
    is_ending_ = true;
    signal();
    thread_.join();
    close(listener_);
    close(event_);
  }

  const std::string& address() const { return address_; }
  void hold_answers() {
    holds_answers_ = true;
    signal();
  }
  void cut() {
    holds_answers_ = false;
    is_cut_ = true;
    signal();
  }

 private:
  static sockaddr_in on_loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }
  void signal() { eventfd_write(event_, 1); }

  void run() {
    while (!is_ending_) {
      std::array<pollfd, 2> polled = {{{event_, POLLIN, 0}, {listener_, POLLIN, 0}}};
      poll(polled.data(), polled.size(), -1);
      drain_event(polled[0]);
      if (polled[1].revents == 0) continue;
      const int client = accept(listener_, nullptr, nullptr);
      const int server = socket(AF_INET, SOCK_STREAM, 0);
      sockaddr_in address = on_loopback(server_);
      if (connect(server, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) carry(client, server);
      close(client);
      close(server);
    }
  }

  void drain_event(const pollfd& polled) {
    eventfd_t ignored = 0;
    if (polled.revents != 0) eventfd_read(event_, &ignored);
  }

  void carry(int client, int server) {
    is_cut_ = false;
    while (!is_ending_ && !is_cut_) {
      const short answers = holds_answers_ ? 0 : POLLIN;
      std::array<pollfd, 3> polled = {{{event_, POLLIN, 0}, {client, POLLIN, 0}, {server, answers, 0}}};
      poll(polled.data(), polled.size(), -1);
      drain_event(polled[0]);
      if (polled[1].revents != 0 && !pass(client, server)) return;
      if ((polled[2].revents & POLLIN) != 0 && !holds_answers_ && !pass(server, client)) return;
    }
  }

  static bool pass(int from, int to) {
    std::array<char, 65536> bytes{};
    const ssize_t got = recv(from, bytes.data(), bytes.size(), 0);
    return got > 0 && send(to, bytes.data(), static_cast<std::size_t>(got), MSG_NOSIGNAL) == got;
  }

  const int server_;
  int listener_ = -1;
  const int event_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::string address_;
  std::atomic<bool> is_ending_ = false;
  std::atomic<bool> holds_answers_ = false;
  std::atomic<bool> is_cut_ = false;
  std::thread thread_;
};

// Waits until the world has so many bodies.
bool await_bodies(Client& client, std::uint64_t bodies) {
  const absl::Time deadline = absl::Now() + kPatience;
  while (absl::Now() < deadline) {
    const auto status = client.status();
    if (status.ok() && status->bodies == bodies) return true;
  }
  return false;
}

TEST(OnceTest, ASpawnWhoseAnswerIsLostIsGivenAgainAndRunsOnce) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(flat_world(16)).status(), IsOk());
  const std::uint64_t before = cluster.client->status()->bodies;
  Wire wire(cluster.processes->address());
  const auto client = Client::connect(wire.address(), kPatience);
  ASSERT_THAT(client.status(), IsOk());

  wire.hold_answers();
  absl::StatusOr<Spawned> spawned;
  std::thread caller([&] {
    spawned = (*client)->spawn(solid("", box(1, 1, 1), 1, {{0, 0, 0}, {0, 0, 5}}), kPatience);
  });
  EXPECT_TRUE(await_bodies(*cluster.client, before + 1)) << "the command did not arrive";
  wire.cut();
  caller.join();
  ASSERT_THAT(spawned.status(), IsOk());
  EXPECT_EQ(cluster.client->status()->bodies, before + 1);
  EXPECT_THAT(cluster.client->remove(spawned->id).status(), IsOk());
  EXPECT_EQ(cluster.client->status()->bodies, before);
}

}  // namespace
}  // namespace tessera
