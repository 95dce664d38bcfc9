#include "transport/dds_domain.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "dds/dds.h"

#ifdef __SANITIZE_THREAD__
// Debian's Cyclone DDS is not built for the thread sanitizer, which sees its memory accesses but not the
// atomics that guard them. So its code, and what its threads pass to our listeners, is suppressed. This is
// part of every program that uses DDS, so no run needs special settings.
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libddsc.so\n"
         "race:libddsc.so\n";
}
#endif

namespace tessera {
namespace {

struct OpenDomain {
  dds_entity_t entity = 0;
  int users = 0;
};

// Opening and closing happen under the lock: Cyclone DDS refuses a domain that is still closing.
std::mutex mutex;
std::map<std::uint32_t, OpenDomain>& open_domains() {
  static std::map<std::uint32_t, OpenDomain> domains;
  return domains;
}

// The UDP sockets of this process that receive from any interface, by their descriptors.
std::set<int> open_sockets() {
  std::set<int> sockets;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    int descriptor = 0;
    if (!absl::SimpleAtoi(entry.path().filename().string(), &descriptor)) continue;
    int type = 0;
    socklen_t type_size = sizeof type;
    if (getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &type_size) != 0 || type != SOCK_DGRAM) continue;
    sockaddr_in address{};
    socklen_t address_size = sizeof address;
    const bool named = getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &address_size) == 0;
    if (named && address.sin_family == AF_INET && address.sin_addr.s_addr == INADDR_ANY)
      sockets.insert(descriptor);
  }
  return sockets;
}

// Cyclone DDS receives from any interface, whichever it is told to use. Packets of other hosts must not reach
// a cluster on the loopback interface.
void keep_to_loopback(const std::set<int>& sockets_before) {
  constexpr std::string_view kLoopback = "lo";
  for (const int descriptor : open_sockets()) {
    if (sockets_before.contains(descriptor)) continue;
    if (setsockopt(descriptor, SOL_SOCKET, SO_BINDTODEVICE, kLoopback.data(), kLoopback.size()) != 0) {
      std::fprintf(stderr, "tessera: packets of other hosts may reach this process: %s\n",
                   std::strerror(errno));
      return;
    }
  }
}

// Cyclone DDS ends its threads that receive by packets to itself. Where the interface is gone, these do not
// arrive, and it waits forever: then it is left behind, since its process ends.
void close_domain(dds_entity_t entity) {
  constexpr std::chrono::seconds kCloseMax{5};
  std::promise<void> closed;
  const std::future<void> is_closed = closed.get_future();
  std::thread closing([entity, closed = std::move(closed)]() mutable {
    dds_delete(entity);
    closed.set_value();
  });
  if (is_closed.wait_for(kCloseMax) == std::future_status::ready) {
    closing.join();
  } else {
    closing.detach();
  }
}

}  // namespace

absl::StatusOr<DdsDomain> DdsDomain::open(std::uint32_t id, const DdsNetwork& network) {
  const std::lock_guard lock(mutex);
  OpenDomain& domain = open_domains()[id];
  if (domain.users == 0 && std::getenv("CYCLONEDDS_URI") == nullptr) {
    const std::set<int> sockets_before = open_sockets();
    const dds_entity_t entity = dds_create_domain(id, dds_configuration(network).c_str());
    if (entity < 0) {
      open_domains().erase(id);
      if (entity == DDS_RETCODE_PRECONDITION_NOT_MET) {
        return absl::FailedPreconditionError(
            absl::StrCat("DDS domain ", id, " is already open in this process"));
      }
      return dds_error(entity, absl::StrCat("cannot open DDS domain ", id));
    }
    domain.entity = entity;
    if (network.interface == DdsNetwork().interface) keep_to_loopback(sockets_before);
  }
  ++domain.users;
  return DdsDomain(id);
}

DdsDomain::DdsDomain(DdsDomain&& other) noexcept : id_(other.id_), held_(std::exchange(other.held_, false)) {}

DdsDomain::~DdsDomain() {
  if (!held_) return;
  const std::lock_guard lock(mutex);
  OpenDomain& domain = open_domains()[id_];
  if (--domain.users > 0) return;
  if (domain.entity != 0) close_domain(domain.entity);
  open_domains().erase(id_);
}

absl::Status dds_error(std::int32_t return_code, absl::string_view what) {
  const std::string message = absl::StrCat(what, ": ", dds_strretcode(return_code));
  switch (return_code) {
    case DDS_RETCODE_OUT_OF_RESOURCES:
      return absl::ResourceExhaustedError(message);
    case DDS_RETCODE_TIMEOUT:
      return absl::DeadlineExceededError(message);
    default:
      return absl::InternalError(message);
  }
}

std::string topic_name(absl::string_view cluster, absl::string_view rest) {
  std::string name = "tessera/";
  for (const unsigned char c : cluster) {
    // DDS allows few characters; the others are written as their code.
    if (std::isalnum(c) != 0) {
      name += static_cast<char>(c);
    } else {
      absl::StrAppend(&name, absl::StrFormat("_%02x", c));
    }
  }
  return absl::StrCat(name, "/", rest);
}

}  // namespace tessera
