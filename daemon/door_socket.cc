#include "daemon/door_socket.h"

#include <absl/strings/str_cat.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <sys/socket.h>

#include <cerrno>
#include <string>
#include <utility>

namespace tessera {
namespace {

template <typename Object, typename Read, typename Use>
bool take_pem(const std::string& pem, Read read, void (*free)(Object*), Use use) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> bio(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  const std::unique_ptr<Object, decltype(free)> object(read(bio.get(), nullptr, nullptr, nullptr), free);
  return object != nullptr && use(object.get()) == 1;
}

bool is_blocked() { return errno == EAGAIN || errno == EINTR; }

}  // namespace

absl::StatusOr<TlsContext> tls_context_with(const ServerKeys& keys) {
  TlsContext context(SSL_CTX_new(TLS_server_method()), &SSL_CTX_free);
  SSL_CTX* raw = context.get();
  const bool is_ready =
      raw != nullptr && SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION) == 1 &&
      take_pem(keys.certificate, PEM_read_bio_X509, X509_free,
               [raw](X509* certificate) { return SSL_CTX_use_certificate(raw, certificate); }) &&
      take_pem(keys.key, PEM_read_bio_PrivateKey, EVP_PKEY_free,
               [raw](EVP_PKEY* key) { return SSL_CTX_use_PrivateKey(raw, key); }) &&
      SSL_CTX_check_private_key(raw) == 1;
  if (!is_ready) {
    return absl::InvalidArgumentError(
        absl::StrCat(keys.folder.string(), ": certificate and key do not belong together, or are none"));
  }
  SSL_CTX_set_mode(raw, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION);
  return context;
}

DoorSocket::DoorSocket(Descriptor socket, SSL_CTX* context)
    : socket_(std::move(socket)), tls_(context == nullptr ? nullptr : SSL_new(context), &SSL_free) {
  if (tls_ == nullptr) return;
  SSL_set_fd(tls_.get(), socket_.get());
  SSL_set_accept_state(tls_.get());
}

DoorSocket::Result DoorSocket::result_of(int tls_result) {
  const int error = SSL_get_error(tls_.get(), tls_result);
  if (error == SSL_ERROR_WANT_WRITE) waits_to_write_ = true;
  return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE ? Result::kWaits : Result::kOver;
}

DoorSocket::Result DoorSocket::handshake() {
  if (tls_ == nullptr) return Result::kDone;
  ERR_clear_error();
  const int done = SSL_accept(tls_.get());
  return done == 1 ? Result::kDone : result_of(done);
}

DoorSocket::Result DoorSocket::read(char* to, std::size_t size, std::size_t& got) {
  if (tls_ == nullptr) {
    const ssize_t read = recv(socket_.get(), to, size, 0);
    if (read <= 0) return read < 0 && is_blocked() ? Result::kWaits : Result::kOver;
    got = static_cast<std::size_t>(read);
    return Result::kDone;
  }
  ERR_clear_error();
  const int read = SSL_read_ex(tls_.get(), to, size, &got);
  return read == 1 ? Result::kDone : result_of(read);
}

DoorSocket::Result DoorSocket::write(const char* from, std::size_t size, std::size_t& sent) {
  if (tls_ == nullptr) {
    const ssize_t written = send(socket_.get(), from, size, MSG_NOSIGNAL);
    if (written < 0) {
      if (!is_blocked()) return Result::kOver;
      waits_to_write_ = true;
      return Result::kWaits;
    }
    sent = static_cast<std::size_t>(written);
    return Result::kDone;
  }
  ERR_clear_error();
  const int written = SSL_write_ex(tls_.get(), from, size, &sent);
  return written == 1 ? Result::kDone : result_of(written);
}

void DoorSocket::end() {
  if (tls_ != nullptr) SSL_shutdown(tls_.get());
  shutdown(socket_.get(), SHUT_WR);
}

}  // namespace tessera
