#include "daemon/whole_request.h"

#include <gtest/gtest.h>

#include <string>

namespace tessera {
namespace {

TEST(WholeRequest, EndsWithItsHeadOrItsBody) {
  const std::string get = "GET /healthz HTTP/1.1\r\nHost: here\r\n\r\n";
  for (std::size_t size = 0; size < get.size(); ++size) {
    EXPECT_EQ(part_of_request(get.substr(0, size)), RequestPart::kSome) << size;
  }
  EXPECT_EQ(part_of_request(get), RequestPart::kWhole);
  EXPECT_EQ(part_of_request(get + "more"), RequestPart::kWhole);
  const std::string post = "POST /login HTTP/1.1\r\ncontent-LENGTH:  9 \r\n\r\ntoken=";
  EXPECT_EQ(part_of_request(post), RequestPart::kSome);
  EXPECT_EQ(part_of_request(post + "abc"), RequestPart::kWhole);
}

TEST(WholeRequest, IsBounded) {
  const std::string large(kRequestHeadBytesMax, 'x');
  EXPECT_EQ(part_of_request(large), RequestPart::kUnfit);
  EXPECT_EQ(part_of_request("GET / HTTP/1.1\r\nA: " + large + "\r\n\r\n"), RequestPart::kUnfit);
  for (const char* header : {"Content-Length: 16385", "Content-Length: -1", "Content-Length: many",
                             "Content-Length: 99999999999999999999", "Transfer-Encoding: chunked"}) {
    EXPECT_EQ(part_of_request(std::string("POST / HTTP/1.1\r\n") + header + "\r\n\r\n"), RequestPart::kUnfit)
        << header;
  }
  EXPECT_EQ(part_of_request("POST / HTTP/1.1\r\nContent-Length: 16384\r\n\r\n"), RequestPart::kSome);
}

}  // namespace
}  // namespace tessera
