// Whom a server waits for in vain.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "cluster.pb.h"
#include "sector_server/round_exchange.h"
#include "transport/link.h"

namespace tessera {

// While a server waits for the same messages for longer than usual, it asks those that owe them whether they
// are there, and where one does not answer, all others: whoever is cut off from many is to go, not one of
// these. It reports who does not answer. Time is counted in questions that it has asked: so a process that
// stood still itself does not find that others were silent meanwhile.
class PeerProbes {
 public:
  static constexpr std::chrono::milliseconds kEvery{250};

  struct Wait {
    RoundExchange::Key round;  // of a guest, which waits for links alone: always the same
    std::vector<NodeId> peers;
    std::vector<NodeId> others;  // servers that it does not wait for
  };

  // Something has come from the server.
  void heard(NodeId peer);
  // The network has lost contact with it.
  void lost(NodeId peer);

  // To be called every kEvery, with what is awaited; returns whom to ask now.
  std::vector<NodeId> look(const std::optional<Wait>& wait);

  // Whether there is somebody to report, and who.
  bool any_unheard() const;
  void write(v1::Report& report) const;

 private:
  struct Peer {
    bool in_contact = false;
    std::uint32_t asked = 0;  // so often since it was last heard, in this wait
  };

  std::map<NodeId, Peer> peers_;
  std::optional<RoundExchange::Key> round_;  // at the last look
};

}  // namespace tessera
