// A minimal HTTP client, for tests.
#pragma once

#include <civetweb.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/address.h"

namespace tessera {

struct HttpAnswer {
  int code = 0;
  std::string body;
};

// Fails the test, and returns code 0, if there is no answer.
inline HttpAnswer http_get(const std::string& address, const std::string& path) {
  const ListenAddress place = parse_listen_address(address).value_or(ListenAddress());
  char error[256] = "";
  mg_connection* connection = mg_download(place.host.c_str(), place.port, /*use_ssl=*/0, error, sizeof error,
                                          "GET %s HTTP/1.0\r\nHost: test\r\n\r\n", path.c_str());
  EXPECT_NE(connection, nullptr) << address << path << ": " << error;
  if (connection == nullptr) return {};
  HttpAnswer answer{.code = mg_get_response_info(connection)->status_code, .body = ""};
  char buffer[4096];
  for (int got = 0; (got = mg_read(connection, buffer, sizeof buffer)) > 0;) {
    answer.body.append(buffer, static_cast<std::size_t>(got));
  }
  mg_close_connection(connection);
  return answer;
}

}  // namespace tessera
