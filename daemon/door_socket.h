// A client's socket as a door has it: with TLS or without.
#pragma once

#include <absl/status/statusor.h>
#include <openssl/ssl.h>

#include <cstddef>
#include <memory>

#include "keys/gate.h"
#include "transport/descriptor.h"

namespace tessera {

using TlsContext = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;

// Of a server with these keys. INVALID_ARGUMENT for keys that OpenSSL does not take.
absl::StatusOr<TlsContext> tls_context_with(const ServerKeys& keys);

// Never blocks.
class DoorSocket {
 public:
  enum class Result { kDone, kWaits, kOver };

  // TLS unless `context` is null.
  DoorSocket(Descriptor socket, SSL_CTX* context);

  int descriptor() const { return socket_.get(); }
  // Since begin_turn().
  bool waits_to_write() const { return waits_to_write_; }
  void begin_turn() { waits_to_write_ = false; }

  // kOver where the client has ended or broken the connection.
  Result handshake();
  Result read(char* to, std::size_t size, std::size_t& got);
  Result write(const char* from, std::size_t size, std::size_t& sent);
  // Tells the client that no more comes.
  void end();

 private:
  Result result_of(int tls_result);

  Descriptor socket_;
  std::unique_ptr<SSL, decltype(&SSL_free)> tls_;  // null without TLS
  bool waits_to_write_ = false;                    // TLS writes while it reads, too
};

}  // namespace tessera
