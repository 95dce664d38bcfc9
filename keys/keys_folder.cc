#include "keys/keys_folder.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/create_channel.h>

#include <fstream>
#include <iterator>
#include <system_error>

namespace tessera {

std::filesystem::path keys_for(const std::filesystem::path& keys, const std::string& inner) {
  std::error_code ignored;
  return std::filesystem::exists(keys / kAuthorityFolder, ignored) ? keys / inner : keys;
}

absl::StatusOr<std::string> read_small_file(const std::filesystem::path& file) {
  constexpr std::size_t kBytesMax = 1 << 20;
  std::ifstream in(file, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(in), {});
  if (in.bad() || text.empty() || text.size() > kBytesMax)
    return absl::NotFoundError(absl::StrCat(file.string(), " is missing, or cannot be read"));
  return text;
}

absl::StatusOr<std::string> read_key_file(const std::filesystem::path& file) {
  absl::StatusOr<std::string> text = read_small_file(file);
  if (text.ok()) return text;
  return absl::NotFoundError(
      absl::StrCat(text.status().message(), ": `tessera keys create` makes such folders"));
}

absl::StatusOr<ClientKeys> ClientKeys::read(const std::filesystem::path& keys) {
  ClientKeys read;
  if (keys.empty()) return read;
  const std::filesystem::path folder = keys_for(keys, kAdminFolder);
  absl::StatusOr<std::string> authority = read_key_file(folder / kAuthorityFile);
  if (!authority.ok()) return authority.status();
  read.authority_ = *std::move(authority);
  absl::StatusOr<std::string> key = read_key_file(folder / kKeyFile);
  absl::StatusOr<std::string> certificate = read_key_file(folder / kCertificateFile);
  const bool has_certificate = key.ok() && certificate.ok();
  if (has_certificate) {
    read.key_ = *std::move(key);
    read.certificate_ = *std::move(certificate);
  }
  const absl::StatusOr<std::string> token = read_key_file(folder / kTokenFile);
  if (!token.ok()) {
    if (has_certificate) return read;
    return absl::NotFoundError(absl::StrCat(folder.string(), " has neither ", kCertificateFile, " and ",
                                            kKeyFile, " nor ", kTokenFile));
  }
  read.token_ = std::string(absl::StripAsciiWhitespace(*token));
  return read;
}

ClientKeys ClientKeys::without_identity() const {
  ClientKeys keys;
  keys.authority_ = authority_;
  return keys;
}

std::shared_ptr<grpc::Channel> ClientKeys::channel(const std::string& address,
                                                   grpc::ChannelArguments arguments) const {
  if (empty()) return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  arguments.SetSslTargetNameOverride(kDaemonName);
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::SslCredentials(
      {.pem_root_certs = authority_, .pem_private_key = key_, .pem_cert_chain = certificate_});
  if (!token_.empty()) {
    credentials = grpc::CompositeChannelCredentials(credentials, grpc::AccessTokenCredentials(token_));
  }
  return grpc::CreateCustomChannel(address, credentials, arguments);
}

}  // namespace tessera
