// How many substeps a contact asks for. An island takes as many as the contact that asks for most.
//
// An impulse propagates by one contact a pass, and is attenuated by the load ratio: what the contact bears,
// by the weight of the lighter of its bodies, less its own weight. The lowest contact of a tower of ten equal
// boxes has 9, and the one between a box of 1 kg and the box of 1000 kg on it has 999. It is read from the
// impulses of the last ticks and from the weight of the two bodies, so that nobody needs to look at an island
// as a whole.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

// What a contact remembers of its impulses.
struct ContactNeed {
  double impulse = 0;          // N s, along its normals, in the last tick in which it was solved
  std::uint16_t substeps = 0;  // that it asks for; of no meaning before `ticks` is kTicksToKnow
  std::uint8_t ticks = 0;      // in which it was solved; counted up to kTicksToKnow

  bool is_known() const { return ticks == kTicksToKnow; }

  static constexpr std::uint8_t kTicksToKnow = 3;
  static constexpr std::uint16_t kSubstepsMost = 1024;  // of islands of few bodies
};

// What else is known of a contact.
struct ContactScale {
  double inverse_mass = 0;  // 1/kg, of the lighter body as its contacts feel it: times its nimbleness
  double extent = 0;        // m, the smallest one of the bodies that can be pushed
  // The heavier body's weight by the lighter one's, as far as it rests on that; impulses only tell of a load
  // once they bear it.
  double rests_on = 0;
  // The bodies rest on each other, as far as one sees: a contact of which little is known yet was placed so,
  // and may bear much.
  bool is_at_rest = false;
  // m, how far forces other than gravity would move one of the bodies in this tick, from rest; of no meaning
  // once the contact is known. What presses hard has sunk in before it is known.
  double pressed = 0;
  // How much more easily than a block around its shape a body turns; 1 for usual ones. A contact beside the
  // centre of such a body turns it away before it bears its weight, as if it bore that of other bodies. SDF
  // has moments of 1 kg m^2 for a link without <inertia>, whatever its mass: 1000 kg and 2 m are at 667.
  double nimbleness = 1;
  // What it bears is found at once, however much that is: joints hold both bodies, or one, and the other
  // cannot be pushed. Then only how far it gives way asks for substeps.
  bool is_found_at_once = false;
};

// What of a world decides how many substeps there are.
struct Substepping {
  bool adapts = true;          // to what islands need; if not, all take the usual number
  int usual = 4;               // substeps of a tick
  double gravity = 9.81;       // m/s^2
  double time_step = 1. / 60;  // s, of a tick
};

// The rule.
class ContactNeeds {
 public:
  // Of weights that rest on a body, by its own: what is no more asks for nothing.
  static constexpr double kLightLoad = 1.5;

  // That islands of any number of bodies may take.
  static constexpr int kSubstepsOfMany = 64;

  explicit ContactNeeds(const Substepping& world);

  // What an island asks for in which no contact asks for more.
  int least() const;

  // m/s, what a body gains in a tick: two that move past each other more slowly may rest.
  double speed_at_rest() const { return tick_weight_; }

  int substeps(const ContactNeed& need, const ContactScale& scale) const;

  // What an island of so many bodies takes, asked for so many: small ones may take more, where they cost
  // little.
  int granted(int substeps, std::size_t bodies) const;

  // Notes an impulse (N s). What counts is the smaller impulse of two ticks, as an impact is not a load; and
  // fewer substeps are asked for only where clearly fewer will do, since their number decides how stiff
  // contacts are.
  void note(ContactNeed& need, double impulse, const ContactScale& scale) const;

  // What jointed bodies ask for that turn by this angle in a tick, rad.
  int for_turn(double turn) const;

  // What a jointed body asks for on which `mass` kg hang by a joint `lever` m from its centre: the pull turns
  // it back to its line like a pendulum, at sqrt(pull lever / inertia). `mobility` is 1 / inertia, 1/(kg
  // m^2).
  int for_pull(double mass, double lever, double mobility) const;

 private:
  int for_load(double load_ratio) const;
  int for_size(double load_ratio, double sink_max) const;

  int for_angle(double angle, double most, int substeps_max) const;

  bool adapts_;
  int usual_;
  double tick_weight_;   // N s/kg: the impulse that bears a body's weight in a tick
  double fall_;          // m, in a tick
  double time_step_;     // s
  double load_in_tick_;  // how much farther than usual bodies fall: errors of a substep grow with it
};

}  // namespace tessera
