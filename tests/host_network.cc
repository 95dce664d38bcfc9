#include "tests/host_network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <random>
#include <system_error>

namespace tessera::testing {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kFrameBytesMax = 2048;
constexpr std::size_t kQueuedMax = 100'000;  // frames; more are lost, as in any switch

int must(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

ifreq named(const char* name) {
  ifreq request{};
  std::strncpy(request.ifr_name, name, IFNAMSIZ - 1);
  return request;
}

void set_address(int control, const char* interface, unsigned long what, const std::string& address) {
  ifreq request = named(interface);
  auto& place = reinterpret_cast<sockaddr_in&>(request.ifr_addr);
  place.sin_family = AF_INET;
  inet_pton(AF_INET, address.c_str(), &place.sin_addr);
  must(ioctl(control, what, &request), "address");
}

void bring_up(int control, const char* interface) {
  ifreq request = named(interface);
  must(ioctl(control, SIOCGIFFLAGS, &request), "flags");
  request.ifr_flags |= IFF_UP | IFF_RUNNING;
  must(ioctl(control, SIOCSIFFLAGS, &request), "up");
}

// The switch's end of an interface of the namespace that this thread is in. The last byte of its hardware
// address is its number.
int open_port(std::uint8_t number, const std::string& address) {
  const int port = must(open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC), "/dev/net/tun");
  ifreq request = named(HostNetwork::kInterface);
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  must(ioctl(port, TUNSETIFF, &request), "interface");
  const int control = must(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket");
  request = named(HostNetwork::kInterface);
  request.ifr_hwaddr.sa_family = ARPHRD_ETHER;
  const std::array<std::uint8_t, 6> hardware = {2, 0, 0, 0, 0, number};
  std::copy(hardware.begin(), hardware.end(), request.ifr_hwaddr.sa_data);
  must(ioctl(control, SIOCSIFHWADDR, &request), "hardware address");
  set_address(control, HostNetwork::kInterface, SIOCSIFADDR, address);
  set_address(control, HostNetwork::kInterface, SIOCSIFNETMASK, "255.255.255.0");
  bring_up(control, HostNetwork::kInterface);
  bring_up(control, "lo");
  close(control);
  return port;
}

}  // namespace

HostNetwork::HostNetwork(std::size_t hosts) {
  if (hosts > kHostsMax) throw std::system_error(EINVAL, std::generic_category(), "too many hosts");
  for (std::size_t n = 0; n < hosts; ++n) {
    hosts_.push_back(std::make_unique<Host>());
    std::exception_ptr failure;
    std::thread([&, n] {
      try {
        must(unshare(CLONE_NEWNET), "network namespace");
        hosts_[n]->space = must(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC), "namespace");
        hosts_[n]->port = open_port(static_cast<std::uint8_t>(n), address(n));
      } catch (...) {
        failure = std::current_exception();
      }
    }).join();
    if (failure) std::rethrow_exception(failure);
  }
  switch_ = std::thread([this] { run(); });
}

HostNetwork::~HostNetwork() {
  closing_ = true;
  if (switch_.joinable()) switch_.join();
  for (const auto& host : hosts_) {
    close(host->port);
    close(host->space);
  }
}

std::string HostNetwork::address(std::size_t host) const { return "10.77.1." + std::to_string(host + 1); }

void HostNetwork::enter(std::size_t host) const { must(setns(hosts_[host]->space, CLONE_NEWNET), "setns"); }

void HostNetwork::cut(std::size_t host, bool is_cut) { hosts_[host]->is_cut = is_cut; }

void HostNetwork::cut_way(std::size_t from, std::size_t to, bool is_cut) {
  hosts_[from]->is_cut_to[to] = is_cut;
}

void HostNetwork::disturb(std::chrono::milliseconds delay, int lost_of_1000) {
  delay_ms_ = static_cast<int>(delay.count());
  lost_of_1000_ = lost_of_1000;
}

void HostNetwork::run() {
  struct Frame {
    Clock::time_point due;
    std::size_t to;
    std::string bytes;
  };
  std::deque<Frame> queued;
  std::minstd_rand random(1);
  std::vector<pollfd> polled;
  for (const auto& host : hosts_) polled.push_back({host->port, POLLIN, 0});
  std::array<char, kFrameBytesMax> buffer;
  while (!closing_) {
    int wait_ms = 100;
    if (!queued.empty()) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(queued.front().due - Clock::now());
      wait_ms = static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 100));
    }
    poll(polled.data(), polled.size(), wait_ms);
    const Clock::time_point due = Clock::now() + std::chrono::milliseconds(delay_ms_);
    for (std::size_t from = 0; from < hosts_.size(); ++from) {
      for (;;) {
        const ssize_t size = read(hosts_[from]->port, buffer.data(), buffer.size());
        if (size < 6) break;
        if (hosts_[from]->is_cut) continue;
        const bool is_for_all = (buffer[0] & 1) != 0;
        for (std::size_t to = 0; to < hosts_.size(); ++to) {
          if (to == from || (!is_for_all && to != static_cast<std::uint8_t>(buffer[5]))) continue;
          if (hosts_[from]->is_cut_to[to]) continue;
          if (static_cast<int>(random() % 1000) < lost_of_1000_ || queued.size() >= kQueuedMax) continue;
          queued.push_back({due, to, std::string(buffer.data(), static_cast<std::size_t>(size))});
        }
      }
    }
    // A delay that became shorter does not let packets overtake each other.
    while (!queued.empty() && queued.front().due <= Clock::now()) {
      const Frame& frame = queued.front();
      if (!hosts_[frame.to]->is_cut)
        static_cast<void>(!write(hosts_[frame.to]->port, frame.bytes.data(), frame.bytes.size()));
      queued.pop_front();
    }
  }
}

}  // namespace tessera::testing
