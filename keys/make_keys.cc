#include "keys/make_keys.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "keys/certificates.h"
#include "keys/dds_documents.h"
#include "keys/gate.h"
#include "keys/keys_folder.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kPublic = 0644;
constexpr mode_t kPrivate = 0600;
constexpr std::size_t kHostBytesMax = 253;
constexpr int kAuthorityLifetimes = 10;  // of other certificates
constexpr const char* kTokensHead =
    "# ROLE, SHA-256 of the token, and whose it is. Remove a line to lock that token out.\n";

bool is_address(const std::string& host) {
  in6_addr address{};  // as large as either kind
  return inet_pton(AF_INET, host.c_str(), &address) == 1 || inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

bool is_name(const std::string& host) {
  return !host.empty() && host.size() <= kHostBytesMax && host != kDaemonName &&
         std::ranges::all_of(host, [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.' || c == '_';
         });
}

absl::Status make_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0700) == 0) return absl::OkStatus();
  if (errno == EEXIST) return absl::AlreadyExistsError(absl::StrCat(folder.string(), " is there already"));
  return absl::InternalError(absl::StrCat("cannot make ", folder.string(), ": ", std::strerror(errno)));
}

absl::Status write_file(const fs::path& file, const std::string& text, mode_t mode, int flags = O_EXCL) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, mode);
  const bool written =
      descriptor >= 0 && write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (written) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("cannot write ", file.string(), ": ", std::strerror(error)));
}

absl::StatusOr<Identity> read_authority(const fs::path& folder) {
  const absl::StatusOr<std::string> key_text = read_key_file(folder / kAuthorityFolder / kKeyFile);
  if (!key_text.ok()) return key_text.status();
  const absl::StatusOr<std::string> certificate_text =
      read_key_file(folder / kAuthorityFolder / kAuthorityFile);
  if (!certificate_text.ok()) return certificate_text.status();
  absl::StatusOr<PrivateKey> key = read_private_key(*key_text);
  if (!key.ok()) return key.status();
  absl::StatusOr<Certificate> certificate = read_certificate(*certificate_text);
  if (!certificate.ok()) return certificate.status();
  return Identity{*std::move(key), *std::move(certificate)};
}

// A folder with an identity, and whom it is to trust.
absl::Status write_identity(const fs::path& folder, const CertificateRequest& request,
                            const Identity& authority) {
  const absl::StatusOr<Identity> made = make_identity(request, authority);
  if (!made.ok()) return made.status();
  absl::Status status = make_folder(folder);
  if (status.ok()) status = write_file(folder / kAuthorityFile, pem_of(*authority.certificate), kPublic);
  if (status.ok()) status = write_file(folder / kCertificateFile, pem_of(*made->certificate), kPublic);
  if (status.ok()) status = write_file(folder / kKeyFile, pem_of(*made->key), kPrivate);
  return status;
}

absl::Status write_client(const fs::path& folder, const std::string& name, ClientRole role, int days,
                          const Identity& authority) {
  absl::Status status = write_identity(
      folder / name,
      {.name = name, .names = {absl::StrCat("URI:", uri_of(role))}, .is_client = true, .days = days},
      authority);
  if (!status.ok()) return status;
  const absl::StatusOr<std::string> token = make_token();
  if (!token.ok()) return token.status();
  status = write_file(folder / name / kTokenFile, *token + "\n", kPrivate);
  for (const char* server : {kDaemonFolder, kGatewayFolder, kViewerFolder}) {
    if (!status.ok()) return status;
    if (!fs::exists(folder / server)) continue;  // keys that are older than gateways
    status = write_file(folder / server / kTokensFile, Tokens::line(role, *token, name), kPrivate, O_APPEND);
  }
  return status;
}

absl::Status write_server(const fs::path& folder, CertificateRequest request,
                          const std::vector<std::string>& hosts, const Identity& authority) {
  request.is_server = true;
  for (const char* name : {"DNS:localhost", "IP:127.0.0.1", "IP:::1"}) request.names.emplace_back(name);
  for (const std::string& host : hosts) {
    request.names.push_back(absl::StrCat(is_address(host) ? "IP:" : "DNS:", host));
  }
  if (absl::Status status = write_identity(folder, request, authority); !status.ok()) return status;
  return write_file(folder / kTokensFile, kTokensHead, kPrivate);
}

// What the daemons' bus needs beside their identity.
absl::Status write_dds_documents(const fs::path& folder, const Identity& authority) {
  const absl::StatusOr<std::string> pem = read_key_file(folder / kCertificateFile);
  if (!pem.ok()) return pem.status();
  const absl::StatusOr<Certificate> certificate = read_certificate(*pem);
  if (!certificate.ok()) return certificate.status();
  const std::string permissions = absl::StrFormat(kPermissionsFormat, last_day_of(**certificate));
  for (const auto& [file, document] :
       {std::pair(kGovernanceFile, std::string(kGovernance)), std::pair(kPermissionsFile, permissions)}) {
    const absl::StatusOr<std::string> text = sign_document(document, authority);
    if (!text.ok()) return text.status();
    if (absl::Status status = write_file(folder / file, *text, kPublic); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status make_keys(const NewKeys& wanted) {
  for (const std::string& host : wanted.hosts) {
    if (!is_address(host) && !is_name(host)) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", host, "' is neither a name of a host nor an address"));
    }
  }
  // Authorities of different clusters have different names, so that errors tell them apart.
  const absl::StatusOr<std::string> token = make_token();
  if (!token.ok()) return token.status();
  const absl::StatusOr<Identity> authority =
      make_authority(absl::StrCat("authority ", token->substr(0, 8)), kAuthorityLifetimes * wanted.days);
  if (!authority.ok()) return authority.status();
  const fs::path& folder = wanted.folder;
  absl::Status status = make_folder(folder);
  if (status.ok()) status = make_folder(folder / kAuthorityFolder);
  if (status.ok())
    status = write_file(folder / kAuthorityFolder / kAuthorityFile, pem_of(*authority->certificate), kPublic);
  if (status.ok())
    status = write_file(folder / kAuthorityFolder / kKeyFile, pem_of(*authority->key), kPrivate);
  if (status.ok()) {
    status = write_server(folder / kDaemonFolder,
                          {.name = kDaemonName,
                           // Coordinators that stand by are clients of the one that leads.
                           .names = {absl::StrCat("DNS:", kDaemonName)},
                           .is_client = true,
                           .days = wanted.days},
                          wanted.hosts, *authority);
  }
  if (status.ok()) status = write_dds_documents(folder / kDaemonFolder, *authority);
  if (status.ok()) {
    // Clients accept it as a daemon; its role says that it is none.
    status = write_server(
        folder / kGatewayFolder,
        {.name = kGatewayFolder,
         .names = {absl::StrCat("DNS:", kDaemonName), absl::StrCat("URI:", uri_of(ClientRole::kObserve))},
         .is_client = true,
         .days = wanted.days},
        wanted.hosts, *authority);
  }
  if (status.ok()) {
    status = write_server(folder / kViewerFolder,
                          {.name = kViewerFolder,
                           .names = {absl::StrCat("URI:", uri_of(ClientRole::kControl))},
                           .is_client = true,
                           .days = wanted.days},
                          wanted.hosts, *authority);
  }
  for (const ClientRole role : {ClientRole::kObserve, ClientRole::kControl, ClientRole::kAdmin}) {
    if (status.ok()) status = write_client(folder, std::string(name_of(role)), role, wanted.days, *authority);
  }
  return status;
}

absl::Status add_client(const fs::path& folder, const std::string& name, ClientRole role, int days) {
  if (!is_name(name) || name.front() == '.') {
    return absl::InvalidArgumentError(
        absl::StrCat("'", name, "' is no name for a client: letters, digits, '-', '_' and '.' are allowed"));
  }
  const absl::StatusOr<Identity> authority = read_authority(folder);
  if (!authority.ok()) return authority.status();
  return write_client(folder, name, role, days, *authority);
}

absl::StatusOr<std::string> describe_keys(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const bool is_authority = entry.path().filename() == kAuthorityFolder;
    const fs::path file = entry.path() / (is_authority ? kAuthorityFile : kCertificateFile);
    if (fs::exists(file)) files.push_back(file);
  }
  if (fs::exists(folder / kCertificateFile, error)) files.push_back(folder / kCertificateFile);
  if (files.empty()) return absl::NotFoundError(absl::StrCat("there are no keys in ", folder.string()));
  std::ranges::sort(files);
  std::string text;
  for (const fs::path& file : files) {
    const absl::StatusOr<std::string> pem = read_key_file(file);
    if (!pem.ok()) return pem.status();
    const absl::StatusOr<Certificate> certificate = read_certificate(*pem);
    if (!certificate.ok())
      return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", certificate.status().message()));
    absl::StrAppend(&text, file.parent_path().filename().string(), "  until ", last_day_of(**certificate));
    for (const std::string& name : names_of(**certificate)) absl::StrAppend(&text, "  ", name);
    absl::StrAppend(&text, "\n");
  }
  return text;
}

}  // namespace tessera
