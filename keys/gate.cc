#include "keys/gate.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>
#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_metadata_processor.h>
#include <grpcpp/security/server_credentials.h>
#include <openssl/sha.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "keys/keys_folder.h"

namespace tessera {
namespace {

constexpr absl::string_view kRoleUri = "urn:tessera:role:";
constexpr absl::string_view kBearer = "Bearer ";
constexpr absl::string_view kBetweenDaemons = "/tessera.v1.Coordination/";

std::string digest_of(absl::string_view token) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return absl::BytesToHexString(digest);
}

class Gate final : public grpc::AuthMetadataProcessor {
 public:
  explicit Gate(Tokens tokens) : tokens_(std::move(tokens)) {}

  bool IsBlocking() const override { return false; }

  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* client, OutputMetadata*,
                       OutputMetadata*) override {
    const auto path = metadata.find(":path");
    const absl::string_view call = path == metadata.end()
                                       ? absl::string_view()
                                       : absl::string_view(path->second.data(), path->second.size());
    const std::optional<ClientRole> needed = role_needed(call);
    if (!needed)
      return {grpc::StatusCode::PERMISSION_DENIED, absl::StrCat("there is no call ", absl::CHexEscape(call))};
    if (absl::StartsWith(call, kBetweenDaemons) && is_daemon(*client)) return grpc::Status::OK;
    const std::optional<Caller> caller = tokens_.caller_of(metadata, *client);
    if (!caller) {
      return {grpc::StatusCode::UNAUTHENTICATED,
              "this cluster wants to know who calls: give --keys FOLDER (or TESSERA_KEYS) with a certificate "
              "or a "
              "token that it knows"};
    }
    if (caller->role < *needed) {
      return {
          grpc::StatusCode::PERMISSION_DENIED,
          absl::StrCat("the role ", name_of(caller->role), " may not do this: it needs ", name_of(*needed))};
    }
    return grpc::Status::OK;
  }

 private:
  // Daemons have no role: they serve, and call only each other. A gateway, to which clients talk as to a
  // daemon, has one, and is none.
  static bool is_daemon(const grpc::AuthContext& client) {
    const std::vector<grpc::string_ref> names = client.FindPropertyValues(GRPC_X509_SAN_PROPERTY_NAME);
    const auto has_role = [](const grpc::string_ref& name) {
      return role_of_uri({name.data(), name.size()}).has_value();
    };
    return std::ranges::find(names, grpc::string_ref(kDaemonName)) != names.end() &&
           std::ranges::none_of(names, has_role);
  }

  const Tokens tokens_;
};

}  // namespace

absl::StatusOr<Tokens> Tokens::parse(absl::string_view text) {
  Tokens tokens;
  std::size_t number = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view content = absl::StripAsciiWhitespace(line);
    if (content.empty() || content.front() == '#') continue;
    const std::vector<std::string> words = absl::StrSplit(content, ' ', absl::SkipEmpty());
    const std::optional<ClientRole> role = parse_role(words[0]);
    if (!role || words.size() < 2 || words[1].size() != 2 * SHA256_DIGEST_LENGTH) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number, " is not ROLE DIGEST NAME"));
    }
    tokens.by_digest_[absl::AsciiStrToLower(words[1])] = {*role, words.size() > 2 ? words[2] : std::string()};
  }
  return tokens;
}

std::string Tokens::line(ClientRole role, absl::string_view token, absl::string_view name) {
  return absl::StrCat(name_of(role), " ", digest_of(token), " ", name, "\n");
}

const Caller* Tokens::find(absl::string_view token) const {
  const auto found = by_digest_.find(digest_of(token));
  return found == by_digest_.end() ? nullptr : &found->second;
}

const Caller* Tokens::find_header(absl::string_view value) const {
  return absl::ConsumePrefix(&value, kBearer) ? find(value) : nullptr;
}

std::optional<ClientRole> Tokens::role_of(absl::string_view token) const {
  const Caller* const caller = find(token);
  return caller == nullptr ? std::nullopt : std::optional(caller->role);
}

std::optional<ClientRole> Tokens::role_of_header(absl::string_view value) const {
  const Caller* const caller = find_header(value);
  return caller == nullptr ? std::nullopt : std::optional(caller->role);
}

std::optional<Caller> Tokens::caller_of(const std::multimap<grpc::string_ref, grpc::string_ref>& headers,
                                        const grpc::AuthContext& client) const {
  std::optional<Caller> caller;
  for (const grpc::string_ref& uri : client.FindPropertyValues(GRPC_X509_SAN_PROPERTY_NAME)) {
    const std::optional<ClientRole> role = role_of_uri({uri.data(), uri.size()});
    if (!role || (caller && caller->role >= *role)) continue;
    const std::vector<grpc::string_ref> names = client.FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
    caller = Caller{*role, names.empty() ? std::string() : std::string(names[0].data(), names[0].size())};
  }
  const auto [begin, end] = headers.equal_range("authorization");
  for (auto given = begin; given != end; ++given) {
    const Caller* const known = find_header({given->second.data(), given->second.size()});
    if (known != nullptr && (!caller || caller->role < known->role)) caller = *known;
  }
  return caller;
}

absl::StatusOr<ServerKeys> read_server_keys(const std::filesystem::path& keys, const std::string& inner) {
  ServerKeys read;
  read.folder = keys_for(keys, inner);
  for (const auto& [file, text] :
       {std::pair(kAuthorityFile, &read.authority), std::pair(kCertificateFile, &read.certificate),
        std::pair(kKeyFile, &read.key)}) {
    absl::StatusOr<std::string> content = read_key_file(read.folder / file);
    if (!content.ok()) return content.status();
    *text = *std::move(content);
  }
  const absl::StatusOr<std::string> tokens = read_key_file(read.folder / kTokensFile);
  if (!tokens.ok()) return tokens.status();
  absl::StatusOr<Tokens> parsed = Tokens::parse(*tokens);
  if (!parsed.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat((read.folder / kTokensFile).string(), ": ", parsed.status().message()));
  }
  read.tokens = *std::move(parsed);
  return read;
}

std::optional<ClientRole> role_of_uri(absl::string_view uri) {
  if (!absl::ConsumePrefix(&uri, kRoleUri)) return std::nullopt;
  return parse_role(uri);
}

std::string uri_of(ClientRole role) { return absl::StrCat(kRoleUri, name_of(role)); }

std::shared_ptr<grpc::ServerCredentials> server_credentials(const std::optional<ServerKeys>& keys) {
  if (!keys) return grpc::InsecureServerCredentials();
  grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_root_certs = keys->authority;
  options.pem_key_cert_pairs.push_back({keys->key, keys->certificate});
  std::shared_ptr<grpc::ServerCredentials> credentials = grpc::SslServerCredentials(options);
  credentials->SetAuthMetadataProcessor(std::make_shared<Gate>(keys->tokens));
  return credentials;
}

}  // namespace tessera
