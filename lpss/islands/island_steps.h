// How many steps islands take in a tick: as many as the contact that asks for most (contact_needs.h), or what
// joints ask for.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "lpss/islands/contact_needs.h"
#include "lpss/islands/island_end.h"
#include "lpss/islands/islands.h"
#include "lpss/joints/rotor.h"

namespace tessera {

template <typename Scalar>
class IslandSteps {
 public:
  // By island. Of `all` islands, bodies, frames and joints are looked at, if there are joints. Valid until
  // the next call.
  std::span<const int> of(std::span<const IslandEnd> islands, const Islands<Scalar>& all,
                          const ContactNeeds& needs, double dt);

 private:
  using Vector = typename Islands<Scalar>::Vector;

  // What the joints of a body say of how it turns.
  struct Turning {
    bool is_tied = false;
    joints::RotorSearch rotor;
    double carrier_moment = 0;  // kg m^2: the least one of what a rotor is held by
  };

  // What is left of a body's joints as the bodies that hang on only one of them are taken off.
  struct Hanging {
    int joints = 0;
    std::size_t all = 0;  // their places, by exclusive or: that of the last one
    double mass = 0;      // kg, with all that hangs on the body
  };

  void ask(std::size_t body, int steps);
  void see(const Islands<Scalar>& all, const IslandJoint& joint, bool is_child);
  double turn_of(const Islands<Scalar>& all, std::size_t body) const;
  void ask_for_turns(const Islands<Scalar>& all, const ContactNeeds& needs, double dt);
  void ask_for_loads(const Islands<Scalar>& all, const ContactNeeds& needs);

  std::vector<int> steps_;
  // Kept for their storage; by body.
  std::vector<std::size_t> island_of_;
  std::vector<Turning> turning_;
  std::vector<Hanging> hanging_;
  std::vector<std::size_t> ends_;  // from which only one joint leads on
};

extern template class IslandSteps<float>;
extern template class IslandSteps<double>;

}  // namespace tessera
