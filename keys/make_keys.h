// Makes the keys of a cluster: its authority, and folders for the daemons, the web UI and clients.
#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>
#include <vector>

#include "keys/role.h"

namespace tessera {

struct NewKeys {
  std::filesystem::path folder;  // see keys_folder.h
  std::vector<std::string>
      hosts;       // names and addresses by which browsers and scrapers reach daemons and web UI
  int days = 365;  // how long certificates are valid; the authority's, ten times as long
};

// Private files are readable for their owner only. ALREADY_EXISTS if there is such a folder, INVALID_ARGUMENT
// for a host that is neither name nor address, INTERNAL with the reason if files cannot be written.
absl::Status make_keys(const NewKeys& wanted);

// One more client. Its token is known to daemons and web UI that are started with the folders as they are
// then. NOT_FOUND without the authority's key; otherwise as make_keys().
absl::Status add_client(const std::filesystem::path& folder, const std::string& name, ClientRole role,
                        int days);

// What a folder of make_keys() has: one line a certificate, with role and last day.
absl::StatusOr<std::string> describe_keys(const std::filesystem::path& folder);

}  // namespace tessera
