#include "coordinator/etcd_access.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "daemon/address.h"
#include "keys/keys_folder.h"

namespace tessera {
namespace {

constexpr const char* kPlain = "http://";
constexpr const char* kTls = "https://";

absl::StatusOr<EtcdMember> member_of(const std::string& url, bool may_be_open) {
  EtcdMember member;
  member.has_tls = absl::StartsWith(url, kTls);
  member.address =
      std::string(absl::StripSuffix(absl::StripPrefix(url, member.has_tls ? kTls : kPlain), "/"));
  const std::optional<ListenAddress> address = parse_listen_address(member.address);
  if (!address) {
    return absl::InvalidArgumentError(
        absl::StrCat("--etcd: '", url, "' is not the URL of an etcd: use https://host:port"));
  }
  if (!member.has_tls && !is_loopback(*address) && !may_be_open) {
    return absl::FailedPreconditionError(
        absl::StrCat("--etcd: without TLS, whoever reaches ", member.address,
                     " decides which coordinator leads: use https://", member.address,
                     ", or write --insecure (insecure = true) where only coordinators reach it"));
  }
  return member;
}

absl::Status read_pem(const char* option, const std::string& file, std::string& text) {
  if (file.empty()) return absl::OkStatus();
  absl::StatusOr<std::string> pem = read_small_file(file);
  if (!pem.ok()) return absl::Status(pem.status().code(), absl::StrCat(option, ": ", pem.status().message()));
  text = *std::move(pem);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<EtcdAccess> etcd_access(const CoordinatorArguments& arguments,
                                       const std::optional<ServerKeys>& keys) {
  EtcdAccess access;
  for (const std::string& url : arguments.etcd) {
    absl::StatusOr<EtcdMember> member = member_of(url, arguments.keys.insecure);
    if (!member.ok()) return member.status();
    access.members.push_back(*std::move(member));
  }
  if (access.members.empty()) return absl::InvalidArgumentError("--etcd: no URL of an etcd is given");
  const EtcdFiles& files = arguments.etcd_files;
  if (files.certificate.empty() != files.key.empty())
    return absl::InvalidArgumentError("--etcd-certificate and --etcd-key go together");
  const bool has_files = !files.authority.empty() || !files.certificate.empty();
  const bool has_tls = std::ranges::any_of(access.members, &EtcdMember::has_tls);
  if (has_files && !has_tls) {
    return absl::InvalidArgumentError(
        "--etcd-ca, --etcd-certificate and --etcd-key need an --etcd that begins with https://");
  }
  if (has_tls && !has_files && keys) {
    access.authority = keys->authority;
    access.certificate = keys->certificate;
    access.key = keys->key;
    return access;
  }
  absl::Status status = read_pem("--etcd-ca", files.authority, access.authority);
  if (status.ok()) status = read_pem("--etcd-certificate", files.certificate, access.certificate);
  if (status.ok()) status = read_pem("--etcd-key", files.key, access.key);
  if (!status.ok()) return status;
  return access;
}

}  // namespace tessera
