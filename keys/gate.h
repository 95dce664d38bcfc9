// Lets in whom a daemon's keys name: the other side of ClientKeys.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <grpcpp/support/string_ref.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "keys/role.h"

namespace grpc {
class AuthContext;
class ServerCredentials;
}  // namespace grpc

namespace tessera {

// Who calls.
struct Caller {
  ClientRole role = ClientRole::kObserve;
  std::string name;  // of the client's key
};

// Whose each token is. Tokens are random, so their SHA-256 is as good as themselves here, and worth
// nothing to who reads it.
class Tokens {
 public:
  // Lines of "ROLE DIGEST NAME". INVALID_ARGUMENT with the number of a line that is none.
  static absl::StatusOr<Tokens> parse(absl::string_view text);
  static std::string line(ClientRole role, absl::string_view token, absl::string_view name);

  std::optional<ClientRole> role_of(absl::string_view token) const;
  // Of a header "Authorization: Bearer TOKEN", without its name.
  std::optional<ClientRole> role_of_header(absl::string_view value) const;
  // Of a call with these headers: by the client's certificate or token, whichever has the higher role.
  std::optional<Caller> caller_of(const std::multimap<grpc::string_ref, grpc::string_ref>& headers,
                                  const grpc::AuthContext& client) const;

 private:
  const Caller* find(absl::string_view token) const;
  const Caller* find_header(absl::string_view value) const;

  std::map<std::string, Caller> by_digest_;
};

// What a daemon, or the web UI, has.
struct ServerKeys {
  std::string authority;
  std::string certificate;
  std::string key;
  Tokens tokens;
  std::filesystem::path folder;
};

// Of the folder `keys`, in which `inner` is the reader's own. NOT_FOUND, INVALID_ARGUMENT.
absl::StatusOr<ServerKeys> read_server_keys(const std::filesystem::path& keys, const std::string& inner);

// The role that a client's certificate names in its URI. Nullopt if it is none of ours.
std::optional<ClientRole> role_of_uri(absl::string_view uri);
std::string uri_of(ClientRole role);

// TLS, by which each call is admitted that role_needed() grants to the client's certificate or token; others
// end with UNAUTHENTICATED or PERMISSION_DENIED. Without keys: everything, from everyone, in the clear.
std::shared_ptr<grpc::ServerCredentials> server_credentials(const std::optional<ServerKeys>& keys);

}  // namespace tessera
