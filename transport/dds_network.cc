#include "transport/dds_network.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <tinyxml2.h>

#include <array>
#include <cstdlib>
#include <set>

#include "transport/dds_domain.h"

namespace tessera {
namespace {

// A real network loses too many datagrams of 64 KB.
constexpr std::array kLoopbackOnly = {"MaxMessageSize", "MaxRexmitMessageSize", "FragmentSize"};

std::set<std::string> addresses_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;  // as used by Cyclone DDS
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0) return {};
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  std::set<std::string> addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    char text[INET_ADDRSTRLEN];
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ai_addr);
    addresses.insert(inet_ntop(AF_INET, &address->sin_addr, text, sizeof text));
  }
  return addresses;
}

// One of the three plugins that Cyclone DDS loads.
tinyxml2::XMLElement* add_plugin(tinyxml2::XMLElement& security, const char* name, const char* library,
                                 const char* function) {
  tinyxml2::XMLElement* plugin = security.InsertNewChildElement(name);
  tinyxml2::XMLElement* loaded = plugin->InsertNewChildElement("Library");
  loaded->SetAttribute("path",
                       absl::StrCat(TESSERA_DDS_PLUGINS, "/libdds_security_", library, ".so").c_str());
  loaded->SetAttribute("initFunction", absl::StrCat("init_", function).c_str());
  loaded->SetAttribute("finalizeFunction", absl::StrCat("finalize_", function).c_str());
  return plugin;
}

void add_security(tinyxml2::XMLElement& domain, const std::string& keys) {
  tinyxml2::XMLElement& security = *domain.InsertNewChildElement("Security");
  const auto add_file = [&](tinyxml2::XMLElement* plugin, const char* name, const char* file) {
    plugin->InsertNewChildElement(name)->SetText(absl::StrCat("file:", keys, "/", file).c_str());
  };
  tinyxml2::XMLElement* authentication = add_plugin(security, "Authentication", "auth", "authentication");
  add_file(authentication, "IdentityCA", "authority.pem");
  add_file(authentication, "IdentityCertificate", "certificate.pem");
  add_file(authentication, "PrivateKey", "key.pem");
  tinyxml2::XMLElement* access = add_plugin(security, "AccessControl", "ac", "access_control");
  add_file(access, "PermissionsCA", "authority.pem");
  add_file(access, "Governance", "governance.p7s");
  add_file(access, "Permissions", "permissions.p7s");
  add_plugin(security, "Cryptographic", "crypto", "crypto");
}

}  // namespace

std::string dds_configuration(const DdsNetwork& network) {
  tinyxml2::XMLDocument document;
  document.Parse(kDefaultDdsConfig);
  tinyxml2::XMLElement* domain = document.RootElement()->FirstChildElement("Domain");
  tinyxml2::XMLElement* general = domain->FirstChildElement("General");
  if (network.interface != DdsNetwork().interface) {
    general->FirstChildElement("Interfaces")
        ->FirstChildElement("NetworkInterface")
        ->SetAttribute("name", network.interface.c_str());
    for (const char* name : kLoopbackOnly) general->DeleteChild(general->FirstChildElement(name));
  }
  tinyxml2::XMLElement* peers = domain->FirstChildElement("Discovery")->FirstChildElement("Peers");
  peers->DeleteChildren();
  for (const std::string& host : network.peers) {
    for (const std::string& address : addresses_of(host)) {
      peers->InsertNewChildElement("Peer")->SetAttribute("Address", address.c_str());
    }
  }
  if (!network.keys.empty()) add_security(*domain, network.keys);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace tessera
