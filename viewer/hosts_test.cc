#include "viewer/hosts.h"

#include <gtest/gtest.h>

namespace tessera::viewer {
namespace {

TEST(Hosts, AreThoseThatNoStrangerCanName) {
  const Hosts hosts({"Tessera.example"});
  for (const char* host : {"127.0.0.1:7380", "10.0.0.7", "[::1]:7380", "[fe80::1]", "localhost:7380",
                           "LOCALHOST", "tessera.example", "TESSERA.EXAMPLE:80"}) {
    EXPECT_TRUE(hosts.allows(host)) << host;
  }
  for (const char* host : {"", ":7380", "attacker.example:7380", "127.0.0.1.attacker.example",
                           "tessera.example.org", "[attacker]", "::1", "[::1"}) {
    EXPECT_FALSE(hosts.allows(host)) << host;
  }
}

}  // namespace
}  // namespace tessera::viewer
