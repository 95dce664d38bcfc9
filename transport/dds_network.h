// How Cyclone DDS finds the other processes of a cluster: over which interface, at which hosts.
#pragma once

#include <string>
#include <vector>

namespace tessera {

// Of two processes at least the one that starts later must name the other's host. The defaults are for a
// cluster on one host.
struct DdsNetwork {
  std::string interface = "lo";
  // Addresses, or names, which stand for every address they have when the process starts; those that have
  // none, since their hosts are not there yet, count for nothing.
  std::vector<std::string> peers = {"127.0.0.1"};
};

// deploy/cyclonedds.xml, made for `network`: what it says of the loopback interface is left out for others.
std::string dds_configuration(const DdsNetwork& network);

}  // namespace tessera
