// X.509 certificates over OpenSSL: as much of it as an authority of one cluster needs.
#pragma once

#include <absl/status/statusor.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <vector>

namespace tessera {

struct KeyDeleter {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
struct CertificateDeleter {
  void operator()(X509* certificate) const { X509_free(certificate); }
};
using PrivateKey = std::unique_ptr<EVP_PKEY, KeyDeleter>;
using Certificate = std::unique_ptr<X509, CertificateDeleter>;

// A pair of a key on the curve P-256 and its certificate.
struct Identity {
  PrivateKey key;
  Certificate certificate;
};

struct CertificateRequest {
  std::string name;  // common name
  std::vector<std::string>
      names;  // alternative ones, as OpenSSL writes them: "DNS:lab", "IP:10.0.0.1", "URI:urn:x"
  bool is_server = false;
  bool is_client = false;
  int days = 365;
};

// INTERNAL with OpenSSL's reason, as all calls here.
absl::StatusOr<Identity> make_authority(const std::string& name, int days);
absl::StatusOr<Identity> make_identity(const CertificateRequest& request, const Identity& authority);

std::string pem_of(const X509& certificate);
std::string pem_of(const EVP_PKEY& key);
// INVALID_ARGUMENT for text that is none.
absl::StatusOr<Certificate> read_certificate(const std::string& pem);
absl::StatusOr<PrivateKey> read_private_key(const std::string& pem);

// Its alternative names, as in CertificateRequest, and its last day, "2027-11-24".
std::vector<std::string> names_of(const X509& certificate);
std::string last_day_of(const X509& certificate);

// `document`, signed, as DDS Security reads it (S/MIME).
absl::StatusOr<std::string> sign_document(const std::string& document, const Identity& authority);

// Random bytes as text that fits into headers and forms.
absl::StatusOr<std::string> make_token();

}  // namespace tessera
