// The bodies of one sector that contacts and joints may connect.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lpss/partition/sector.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// The nodes of a sector's graph: the bodies that live there, ascending by id, then the clones in its engine
// world, likewise.
class ContactGraph {
 public:
  struct Node {
    BodyId id;
    BodySlot slot = 0;
    HomeBody* home = nullptr;  // nullptr for clones
    Clone* clone = nullptr;    // nullptr for bodies that live here
    bool dynamic = false;
    bool awake = false;
    bool wants_sleep = false;
    bool jointed = false;  // of bodies that live here
  };

  explicit ContactGraph(const Sector& sector, const ParallelFor& parallel = {});

  // nullptr for static bodies.
  const Node* in_slot(BodySlot slot) const;

  // nullptr for bodies that neither live here nor have a clone here.
  const Node* named(BodyId id) const;

  std::size_t index(const Node* node) const { return static_cast<std::size_t>(node - nodes_.data()); }
  std::size_t size() const { return nodes_.size(); }
  std::size_t homes() const { return homes_; }  // nodes before this place are bodies that live here
  const Node& operator[](std::size_t i) const { return nodes_[i]; }

 private:
  void list_slots();

  std::vector<Node> nodes_;
  std::vector<std::int32_t> by_slot_;
  std::size_t homes_ = 0;
};

}  // namespace tessera
