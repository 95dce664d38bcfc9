// How the processes of a cluster find and reach each other: over which interface, at which hosts, by which
// means.
#pragma once

#include <string>
#include <vector>

namespace tessera {

// Of two processes, at least the one that starts later must name the other's host. The defaults suit a
// cluster on one host.
struct DdsNetwork {
  std::string interface = "lo";
  // Addresses, or names, which stand for all their addresses when the process starts. Names without an
  // address, because their hosts do not exist yet, are skipped.
  std::vector<std::string> peers = {"127.0.0.1"};
  // Small messages between processes of one host and user go through memory that they share.
  bool shared_memory = true;
  // A folder with certificate and permissions of DDS Security, as `tessera keys create` makes it for daemons:
  // only processes that its authority has signed join, and nobody else reads what they say. Empty: everyone
  // joins.
  std::string keys;
};

// deploy/cyclonedds.xml, adapted to `network`: settings for the loopback interface are left out for others.
std::string dds_configuration(const DdsNetwork& network);

}  // namespace tessera
