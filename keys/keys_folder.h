// Folders with keys, as `tessera keys create` makes them, and what a client reads of them.
//
//   keys/authority/   the authority's own key, by which all others are signed: no process needs it
//   keys/daemon/      for the daemons: authority.pem, certificate.pem, key.pem, tokens, governance.p7s,
//   permissions.p7s
//   keys/gateway/     for gateways: the first four; towards the cluster, one is a client that observes
//   keys/viewer/      for the web UI: likewise; it is a client that controls
//   keys/NAME/        for a client: authority.pem, certificate.pem and key.pem, or token, or both
//
// Programs are told one of the inner folders, which is all that they need, or the outer one.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <filesystem>
#include <memory>
#include <string>

namespace tessera {

inline constexpr const char* kAuthorityFile = "authority.pem";
inline constexpr const char* kCertificateFile = "certificate.pem";
inline constexpr const char* kKeyFile = "key.pem";
inline constexpr const char* kTokenFile = "token";    // of a client
inline constexpr const char* kTokensFile = "tokens";  // digests of all, for who checks them

inline constexpr const char* kGovernanceFile =
    "governance.p7s";  // of daemons: what DDS Security is to protect,
inline constexpr const char* kPermissionsFile = "permissions.p7s";  // and who may join; both signed

inline constexpr const char* kAuthorityFolder = "authority";
inline constexpr const char* kDaemonFolder = "daemon";
inline constexpr const char* kGatewayFolder = "gateway";
inline constexpr const char* kViewerFolder = "viewer";
inline constexpr const char* kAdminFolder = "admin";  // what a client is that is told the outer folder

// The name in the certificates of all daemons of a cluster, whatever their hosts: who has one was signed by
// the cluster's own authority.
inline constexpr const char* kDaemonName = "tessera-daemon";

// The inner folder `inner` of `keys` if that is an outer one; otherwise `keys` itself.
std::filesystem::path keys_for(const std::filesystem::path& keys, const std::string& inner);

// All of a small file. NOT_FOUND, with its path, if it is empty, larger than 1 MiB, or cannot be read;
// read_key_file() also tells how such files are made.
absl::StatusOr<std::string> read_small_file(const std::filesystem::path& file);
absl::StatusOr<std::string> read_key_file(const std::filesystem::path& file);

// How a client shows who it is, and whom it accepts as a daemon.
class ClientKeys {
 public:
  // No keys: for daemons that have none either, on loopback.
  ClientKeys() = default;
  // Of `keys`; an empty path means none. NOT_FOUND with the file that is missing.
  static absl::StatusOr<ClientKeys> read(const std::filesystem::path& keys);

  // A channel to a daemon.
  std::shared_ptr<grpc::Channel> channel(const std::string& address, grpc::ChannelArguments arguments) const;
  bool empty() const { return authority_.empty(); }
  // Of who passes on what others call: it accepts the same daemons, and shows nothing itself.
  ClientKeys without_identity() const;

 private:
  std::string authority_;
  std::string certificate_;  // with key_; or neither
  std::string key_;
  std::string token_;  // goes beside a certificate, too: it passes gateways, where certificates end
};

}  // namespace tessera
