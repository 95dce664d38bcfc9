// Shared by all users of DDS in this process: the domain with our configuration, topic names and error texts.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

#include "transport/dds_network.h"

namespace tessera {

// deploy/cyclonedds.xml, as of the build.
extern const char* const kDefaultDdsConfig;

// Keeps a DDS domain of this process configured and alive while it has users. Safe to use from any thread.
class DdsDomain {
 public:
  // Configures the domain with dds_configuration(network), unless the environment variable CYCLONEDDS_URI is
  // set, which Cyclone DDS then reads itself. Errors: FAILED_PRECONDITION if other code in this process has
  // opened the domain, INTERNAL if Cyclone DDS rejects the configuration or the network.
  static absl::StatusOr<DdsDomain> open(std::uint32_t id, const DdsNetwork& network);

  DdsDomain(DdsDomain&& other) noexcept;
  DdsDomain& operator=(DdsDomain&&) = delete;
  ~DdsDomain();

  std::uint32_t id() const { return id_; }

 private:
  explicit DdsDomain(std::uint32_t id) : id_(id), held_(true) {}

  std::uint32_t id_;
  bool held_;
};

// The status for a negative return code of Cyclone DDS.
absl::Status dds_error(std::int32_t return_code, absl::string_view what);

// A topic name for cluster `cluster`, whose name may have any characters.
std::string topic_name(absl::string_view cluster, absl::string_view rest);

}  // namespace tessera
