// Which links between the servers of a world are cut, by what the servers report.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/cut_links.h"
#include "transport/link.h"

namespace tessera {

// That a server does not answer another one (v1::Unheard) may also mean that it computes, or stands still.
// But if it reports to the coordinator meanwhile, it has taken what has come to it by then, and answered:
// where the other one still misses it afterwards, the link between them is cut. So a tick may take as long as
// it likes, and whoever waits for a server that waits itself is answered by it.
class LinkWatch {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // A link is cut where nothing comes through for `patience`; or for `long_patience` where the network sees
  // signs of life, so that a long message may be on its way.
  LinkWatch(Nanoseconds patience, Nanoseconds long_patience)
      : patience_(patience), long_patience_(long_patience) {}

  // A server, also one that takes no part in the world, reports; or `unheard` is of its servers alone.
  void on_report(NodeId from, const std::vector<v1::Unheard>& unheard, Nanoseconds now);

  // Whether some server misses this one, or the other way round, though both report.
  bool is_doubtful(NodeId node) const;

  // A server to be dropped, with those that are cut off from it.
  struct Dropped {
    NodeId node;
    std::vector<NodeId> unheard_by;
    Nanoseconds waited{};
  };
  // Each time that links have been found cut. The links are remembered: see apart().
  std::vector<Dropped> take_dropped(Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const { return due_; }

  // Those of `nodes` that a world must not have together with the others, by what is remembered.
  std::vector<NodeId> apart(const std::vector<NodeId>& nodes) const;
  // This server and those have answered each other.
  void have_met(NodeId node, const std::vector<NodeId>& others);

  // The servers of the world are others: they begin to wait anew.
  void restart();

 private:
  // Of a server for another one.
  struct Complaint {
    Nanoseconds waited{};
    bool silent = false;
    std::optional<Nanoseconds> waited_when_heard;  // when the other one has reported first
  };

  bool lasts(const Complaint& complaint, Nanoseconds patience) const;
  bool is_cut(const Complaint& complaint) const;

  const Nanoseconds patience_;
  const Nanoseconds long_patience_;
  std::map<CutLink, Complaint> complaints_;
  std::optional<Nanoseconds> due_;  // when it is decided who is dropped
  std::set<CutLink> known_;
};

}  // namespace tessera
