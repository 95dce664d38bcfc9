// A minimal HTTPS client, for tests.
#pragma once

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/ssl.h>

#include <memory>
#include <string>

#include "daemon/test_http.h"

namespace tessera {

// Sends `request` over TLS to `address`, whose certificate must be signed by that in the file `authority` and
// have the name `host`. Code 0 if there is no such connection; otherwise `body` is all that comes, with
// headers.
inline HttpAnswer https_request(const std::string& address, const std::string& authority,
                                const std::string& host, const std::string& request) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  &SSL_CTX_free);
  EXPECT_EQ(SSL_CTX_load_verify_locations(context.get(), authority.c_str(), nullptr), 1);
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  const std::unique_ptr<BIO, decltype(&BIO_free_all)> bio(BIO_new_ssl_connect(context.get()), &BIO_free_all);
  BIO_set_conn_hostname(bio.get(), address.c_str());
  SSL* tls = nullptr;
  BIO_get_ssl(bio.get(), &tls);
  SSL_set1_host(tls, host.c_str());
  if (BIO_do_connect(bio.get()) != 1) return {};
  BIO_write(bio.get(), request.data(), static_cast<int>(request.size()));
  HttpAnswer answer;
  char buffer[4096];
  for (int got = 0; (got = BIO_read(bio.get(), buffer, sizeof buffer)) > 0;) {
    answer.body.append(buffer, static_cast<std::size_t>(got));
  }
  if (absl::StartsWith(answer.body, "HTTP/1.1 ")) answer.code = std::stoi(answer.body.substr(9, 3));
  return answer;
}

inline std::string get_request(const std::string& path, const std::string& headers = "") {
  return absl::StrCat("GET ", path, " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n", headers, "\r\n");
}

}  // namespace tessera
