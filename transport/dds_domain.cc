#include "transport/dds_domain.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cctype>
#include <cstdlib>
#include <map>
#include <mutex>
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

}  // namespace

absl::StatusOr<DdsDomain> DdsDomain::open(std::uint32_t id, const DdsNetwork& network) {
  const std::lock_guard lock(mutex);
  OpenDomain& domain = open_domains()[id];
  if (domain.users == 0 && std::getenv("CYCLONEDDS_URI") == nullptr) {
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
  if (domain.entity != 0) dds_delete(domain.entity);
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
