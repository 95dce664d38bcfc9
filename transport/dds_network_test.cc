#include "transport/dds_network.h"

#include <gmock/gmock.h>
#include <tinyxml2.h>

#include "transport/dds_domain.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(DdsNetworkTest, BuiltInConfigurationIsWhatTheDefaultsSay) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(kDefaultDdsConfig), tinyxml2::XML_SUCCESS);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  EXPECT_EQ(dds_configuration({}), printer.CStr());
}

TEST(DdsNetworkTest, OtherInterfacesHaveNoSizesOfLoopback) {
  const std::string text = dds_configuration({.interface = "eth0", .peers = {"192.0.2.1", "192.0.2.2"}});
  EXPECT_THAT(text, HasSubstr(R"(<NetworkInterface name="eth0" multicast="false"/>)"));
  EXPECT_THAT(text, Not(HasSubstr("\"lo\"")));
  EXPECT_THAT(text, Not(HasSubstr("<MaxMessageSize>")));
  EXPECT_THAT(text, HasSubstr(R"(<Peer Address="192.0.2.1"/>)"));
  EXPECT_THAT(text, HasSubstr(R"(<Peer Address="192.0.2.2"/>)"));
  EXPECT_THAT(text, Not(HasSubstr("127.0.0.1")));
}

TEST(DdsNetworkTest, NamesStandForTheirAddressesIfTheyHaveAny) {
  const std::string text = dds_configuration({.peers = {"localhost", "no-such-host.invalid"}});
  EXPECT_THAT(text, HasSubstr(R"(<Peer Address="127.0.0.1"/>)"));
  EXPECT_THAT(text, Not(HasSubstr("no-such-host")));
}

TEST(DdsNetworkTest, KeysCloseTheBus) {
  const std::string text = dds_configuration({.interface = "eth0", .keys = "/etc/keys"});
  for (const char* part :
       {"<IdentityCA>file:/etc/keys/authority.pem</IdentityCA>", "<PrivateKey>file:/etc/keys/key.pem",
        "<Governance>file:/etc/keys/governance.p7s", "<Permissions>file:/etc/keys/permissions.p7s",
        "libdds_security_crypto.so", "init_access_control", "finalize_authentication"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(dds_configuration({.interface = "eth0"}), Not(HasSubstr("Security")));
}

}  // namespace
}  // namespace tessera
