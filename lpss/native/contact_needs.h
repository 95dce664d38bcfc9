// How many substeps a contact asks for. An island takes as many as the contact that asks for most.
//
// An impulse propagates by one contact a pass, and is attenuated by the load ratio: what the contact bears,
// by the weight of the lighter of its bodies, less its own weight. The lowest contact of a tower of ten equal
// boxes has 9, and the one between a box of 1 kg and the box of 1000 kg on it has 999. It is read from the
// impulses of the last ticks and from the weight of the two bodies, so that nobody needs to look at an island
// as a whole.
#pragma once

#include <cstdint>

#include "lpss/model/settings.h"

namespace tessera::native {

// What a contact remembers of its impulses.
struct ContactNeed {
  double impulse = 0;         // N s, along its normals, in the last tick in which it was solved
  std::uint8_t ticks = 0;     // in which it was solved; counted up to kTicksToKnow
  std::uint8_t substeps = 0;  // that it asks for; of no meaning before

  static constexpr std::uint8_t kTicksToKnow = 3;
};

// The rule, for the settings of a world.
class ContactNeeds {
 public:
  explicit ContactNeeds(const WorldSettings& settings);

  // Whether the number of substeps adapts to islands. If not, all take the usual number.
  bool adapts() const { return adapts_; }

  // What an island asks for in which no contact asks for more.
  int least() const;

  // `rests_on`: the heavier body's weight by the lighter one's, as far as it rests on that; impulses only
  // tell of a load once they bear it. `speed`: of the bodies relative to each other, m/s; a contact of which
  // little is known yet, of bodies at rest, was placed so and may bear much.
  int substeps(const ContactNeed& need, double rests_on, double speed) const;

  // Notes an impulse (N s) between bodies of which the lighter has this inverse mass (1/kg). What counts is
  // the smaller impulse of two ticks, as an impact is not a load; and fewer substeps are asked for only where
  // clearly fewer will do, since their number decides how stiff contacts are.
  void note(ContactNeed& need, double impulse, double inverse_mass) const;

  // What jointed bodies ask for that turn by this angle in a tick, rad.
  int for_turn(double turn) const;

 private:
  int for_load(double load_ratio) const;

  bool adapts_;
  int usual_;
  double tick_weight_;  // N s/kg: the impulse that bears a body's weight in a tick
  double fall_;         // how much farther than usual bodies fall in a tick: errors of a substep grow with it
};

}  // namespace tessera::native
