#include "keys/certificates.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <array>
#include <ctime>
#include <utility>

namespace tessera {
namespace {

constexpr int kSerialBits = 127;
constexpr long kDaySeconds = 24 * 60 * 60;
constexpr long kClockSkewSeconds = 5 * 60;  // hosts whose clocks are late accept a new certificate, too

absl::Status failed(const char* what) {
  std::array<char, 256> reason{};
  ERR_error_string_n(ERR_get_error(), reason.data(), reason.size());
  return absl::InternalError(absl::StrCat(what, ": ", reason.data()));
}

bool add_extension(X509& certificate, X509& issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  if (extension == nullptr) return false;
  const bool added = X509_add_ext(&certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return added;
}

bool draw_serial(X509& certificate) {
  BIGNUM* number = BN_new();
  const bool drawn = number != nullptr &&
                     BN_rand(number, kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
                     BN_to_ASN1_INTEGER(number, X509_get_serialNumber(&certificate)) != nullptr;
  BN_free(number);
  return drawn;
}

bool set_name(X509& certificate, const std::string& name) {
  X509_NAME* subject = X509_get_subject_name(&certificate);
  const auto add = [&](const char* field, const std::string& text) {
    return X509_NAME_add_entry_by_txt(subject, field, MBSTRING_UTF8,
                                      reinterpret_cast<const unsigned char*>(text.c_str()), -1, -1, 0) == 1;
  };
  return add("O", "Tessera") && add("CN", name);
}

// A new key, and a certificate of it that is not signed yet.
absl::StatusOr<Identity> unsigned_identity(const std::string& name, int days) {
  Identity made;
  made.key.reset(EVP_EC_gen("P-256"));
  made.certificate.reset(X509_new());
  X509* certificate = made.certificate.get();
  if (!made.key || certificate == nullptr || X509_set_version(certificate, X509_VERSION_3) != 1 ||
      !draw_serial(*certificate) || X509_set_pubkey(certificate, made.key.get()) != 1 ||
      X509_gmtime_adj(X509_getm_notBefore(certificate), -kClockSkewSeconds) == nullptr ||
      X509_gmtime_adj(X509_getm_notAfter(certificate), days * kDaySeconds) == nullptr ||
      !set_name(*certificate, name)) {
    return failed("cannot make a certificate");
  }
  return made;
}

absl::Status sign(Identity& made, X509& issuer, EVP_PKEY& key,
                  const std::vector<std::pair<int, std::string>>& extensions) {
  X509& certificate = *made.certificate;
  if (X509_set_issuer_name(&certificate, X509_get_subject_name(&issuer)) != 1) return failed("cannot sign");
  for (const auto& [kind, value] : extensions) {
    if (!add_extension(certificate, issuer, kind, value)) {
      return failed(absl::StrCat("'", value, "' does not fit into a certificate").c_str());
    }
  }
  return X509_sign(&certificate, &key, EVP_sha256()) > 0 ? absl::OkStatus() : failed("cannot sign");
}

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;

std::string text_of(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

}  // namespace

absl::StatusOr<Identity> make_authority(const std::string& name, int days) {
  absl::StatusOr<Identity> made = unsigned_identity(name, days);
  if (!made.ok()) return made;
  if (absl::Status status = sign(*made, *made->certificate, *made->key,
                                 {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
                                  {NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature"},
                                  {NID_subject_key_identifier, "hash"}});
      !status.ok()) {
    return status;
  }
  return made;
}

absl::StatusOr<Identity> make_identity(const CertificateRequest& request, const Identity& authority) {
  absl::StatusOr<Identity> made = unsigned_identity(request.name, request.days);
  if (!made.ok()) return made;
  std::vector<std::string> uses;
  if (request.is_server) uses.emplace_back("serverAuth");
  if (request.is_client) uses.emplace_back("clientAuth");
  if (absl::Status status = sign(*made, *authority.certificate, *authority.key,
                                 {{NID_basic_constraints, "critical,CA:FALSE"},
                                  {NID_key_usage, "critical,digitalSignature,keyAgreement"},
                                  {NID_ext_key_usage, absl::StrJoin(uses, ",")},
                                  {NID_subject_key_identifier, "hash"},
                                  {NID_authority_key_identifier, "keyid:always"},
                                  {NID_subject_alt_name, absl::StrJoin(request.names, ",")}});
      !status.ok()) {
    return status;
  }
  return made;
}

std::string pem_of(const X509& certificate) {
  const Bio bio(BIO_new(BIO_s_mem()), &BIO_free);
  PEM_write_bio_X509(bio.get(), &certificate);
  return text_of(bio);
}

std::string pem_of(const EVP_PKEY& key) {
  const Bio bio(BIO_new(BIO_s_mem()), &BIO_free);
  PEM_write_bio_PrivateKey(bio.get(), &key, nullptr, nullptr, 0, nullptr, nullptr);
  return text_of(bio);
}

absl::StatusOr<Certificate> read_certificate(const std::string& pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  Certificate certificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  if (!certificate) return absl::InvalidArgumentError("it is not a certificate in PEM");
  return certificate;
}

absl::StatusOr<PrivateKey> read_private_key(const std::string& pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  PrivateKey key(PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr));
  if (!key) return absl::InvalidArgumentError("it is not a private key in PEM");
  return key;
}

std::vector<std::string> names_of(const X509& certificate) {
  std::vector<std::string> names;
  auto* all =
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr));
  for (int n = 0; n < sk_GENERAL_NAME_num(all); ++n) {
    const Bio bio(BIO_new(BIO_s_mem()), &BIO_free);
    GENERAL_NAME_print(bio.get(), sk_GENERAL_NAME_value(all, n));
    names.push_back(text_of(bio));
  }
  GENERAL_NAMES_free(all);
  return names;
}

std::string last_day_of(const X509& certificate) {
  std::tm end{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &end) != 1) return "never";
  return absl::StrFormat("%04d-%02d-%02d", end.tm_year + 1900, end.tm_mon + 1, end.tm_mday);
}

absl::StatusOr<std::string> sign_document(const std::string& document, const Identity& authority) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED;
  const Bio in(BIO_new_mem_buf(document.data(), static_cast<int>(document.size())), &BIO_free);
  const std::unique_ptr<PKCS7, decltype(&PKCS7_free)> signature(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, in.get(), kFlags), &PKCS7_free);
  const Bio again(BIO_new_mem_buf(document.data(), static_cast<int>(document.size())), &BIO_free);
  const Bio out(BIO_new(BIO_s_mem()), &BIO_free);
  if (!signature || SMIME_write_PKCS7(out.get(), signature.get(), again.get(), kFlags) != 1) {
    return failed("cannot sign a document");
  }
  return text_of(out);
}

absl::StatusOr<std::string> make_token() {
  std::array<unsigned char, 32> bytes{};
  if (RAND_bytes(bytes.data(), bytes.size()) != 1) return failed("no random numbers");
  return absl::WebSafeBase64Escape({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace tessera
