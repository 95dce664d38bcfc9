#include "lpss/islands/contact_needs.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

constexpr double kUsualLoad = 20;
constexpr double kLoadAtRest = 21;                 // that a contact at rest may bear until more is known
constexpr double kUnseen = 2;                      // what else may rest on a heavy body, and how it sways
constexpr double kReluctance = 4;                  // to take fewer substeps
constexpr double kEarth = 9.81;                    // m/s^2
constexpr double kUsualFall = kEarth / (60 * 60);  // m
constexpr double kTurnInStepMax = 0.125;           // rad, in one step
constexpr double kSwingMax = 1;                    // rad, of the phase of a swing, in one step
constexpr double kSinkMax = 0.02;                  // of the smallest extent
constexpr double kSinkFoundMax = 0.1;              // likewise, where what it bears is found at once
constexpr std::size_t kBodySubstepsMax = 16384;    // bodies times substeps, beyond kSubstepsMax

}  // namespace

// Without gravity, that of Earth tells what is much.
ContactNeeds::ContactNeeds(const Substepping& world)
    : adapts_(world.adapts && world.usual > 1),
      usual_(world.usual),
      tick_weight_((world.gravity > 0 ? world.gravity : kEarth) * world.time_step),
      fall_(world.gravity * world.time_step * world.time_step),
      time_step_(world.time_step),
      load_in_tick_(std::max(1.0, fall_ / kUsualFall)) {}

int ContactNeeds::for_load(double load_ratio) const {
  const double load = load_ratio * load_in_tick_;
  if (load <= kLightLoad) return std::max(2, usual_ / 2);
  int substeps = usual_;
  for (double most = kUsualLoad; load > most && 2 * substeps <= ContactNeed::kSubstepsMost; most *= 4)
    substeps *= 2;
  return substeps;
}

// Contacts give way by about what a body falls in a step, times the load on them: at most `sink_max`, m.
int ContactNeeds::for_size(double load_ratio, double sink_max) const {
  int substeps = std::max(2, usual_ / 2);
  const double sink = fall_ + load_ratio * tick_weight_ * time_step_;
  while (sink > sink_max * substeps * substeps && 2 * substeps <= ContactNeed::kSubstepsMost) substeps *= 2;
  return substeps;
}

int ContactNeeds::least() const { return adapts_ ? for_load(0) : usual_; }

int ContactNeeds::substeps(const ContactNeed& need, const ContactScale& scale) const {
  if (!adapts_) return usual_;
  double load_ratio =
      std::max(scale.rests_on > kLightLoad ? scale.rests_on * kUnseen : 0, scale.nimbleness - 1);
  if (need.is_known()) return std::max(load_ratio > 0 ? for_load(load_ratio) : 0, int(need.substeps));
  const double pressed = scale.pressed / (tick_weight_ * time_step_);
  load_ratio = std::max({load_ratio, scale.is_at_rest ? kLoadAtRest : 1.0, pressed});
  return std::max(for_load(load_ratio), for_size(pressed, kSinkMax * scale.extent));
}

int ContactNeeds::granted(int substeps, std::size_t bodies) const {
  if (!adapts_) return usual_;
  const std::size_t most = kBodySubstepsMax / std::max<std::size_t>(bodies, 1);
  return std::min(substeps, static_cast<int>(std::clamp<std::size_t>(most, ContactNeeds::kSubstepsOfMany,
                                                                     ContactNeed::kSubstepsMost)));
}

void ContactNeeds::note(ContactNeed& need, double impulse, const ContactScale& scale) const {
  if (!adapts_) return;
  const double sustained = std::min(need.impulse, impulse);
  need.impulse = impulse;
  const bool was_known = need.is_known();
  if (!was_known && ++need.ticks < ContactNeed::kTicksToKnow) return;
  const double load_ratio = std::max(0.0, sustained * scale.inverse_mass / tick_weight_ - 1);
  const auto wanted = [&](double load) {
    if (scale.is_found_at_once)
      return static_cast<std::uint16_t>(for_size(load, kSinkFoundMax * scale.extent));
    return static_cast<std::uint16_t>(std::max(for_load(load), for_size(load, kSinkMax * scale.extent)));
  };
  // A larger load asks for no fewer.
  const std::uint16_t reluctant = wanted(load_ratio * kReluctance);
  if (was_known && reluctant <= need.substeps) {
    need.substeps = reluctant;
  } else if (const std::uint16_t asked = wanted(load_ratio); !was_known || asked > need.substeps) {
    need.substeps = asked;
  }
}

int ContactNeeds::for_turn(double turn) const { return for_angle(turn, kTurnInStepMax, kSubstepsOfMany); }

int ContactNeeds::for_pull(double mass, double lever, double mobility) const {
  return for_angle(std::sqrt(mass * fall_ * lever * mobility), kSwingMax, ContactNeed::kSubstepsMost);
}

// For an angle in a tick, of which a step may have so much, if that takes no more than so many.
int ContactNeeds::for_angle(double angle, double most, int substeps_max) const {
  int substeps = usual_;
  if (!adapts_) return substeps;
  for (most *= usual_; angle > most && 2 * substeps <= substeps_max; most *= 2) substeps *= 2;
  return substeps;
}

}  // namespace tessera
