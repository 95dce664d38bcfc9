// What every user of DDS in this process shares: the domain with our configuration, names and error texts.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

#include "transport/dds_network.h"

namespace tessera {

// deploy/cyclonedds.xml, as it was when this was built.
extern const char* const kDefaultDdsConfig;

// Keeps a DDS domain of this process configured and alive, for as many users as it has. Any thread.
class DdsDomain {
 public:
  // Configures the domain with dds_configuration(network), unless the environment variable CYCLONEDDS_URI is
  // set, which Cyclone DDS then reads itself. Errors: FAILED_PRECONDITION when someone else in this process
  // has opened the domain, INTERNAL when Cyclone DDS does not like the configuration or the network.
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

// A topic name of cluster `cluster`, whatever characters its name has.
std::string topic_name(absl::string_view cluster, absl::string_view rest);

}  // namespace tessera
