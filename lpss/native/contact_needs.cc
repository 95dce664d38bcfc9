#include "lpss/native/contact_needs.h"

#include <algorithm>
#include <cmath>
#include <variant>

namespace tessera::native {
namespace {

constexpr double kLightLoad = 1.5;
constexpr double kUsualLoad = 20;
constexpr double kLoadAtRest = 21;                 // that a contact at rest may bear until more is known
constexpr double kReluctance = 1.25;               // to take fewer substeps
constexpr double kEarth = 9.81;                    // m/s^2
constexpr double kUsualFall = kEarth / (60 * 60);  // m
constexpr double kTurnMax = 0.125;                 // rad, in one step

// m/s^2. Without gravity that of Earth: something must tell what is much.
double weight_of(const Gravity& gravity) {
  const auto* uniform = std::get_if<UniformGravity>(&gravity);
  const double size =
      uniform != nullptr ? uniform->acceleration.norm() : std::get<CentralGravity>(gravity).surface;
  return size > 0 ? size : kEarth;
}

}  // namespace

ContactNeeds::ContactNeeds(const WorldSettings& settings)
    : adapts_(settings.adapt && settings.substeps > 1),
      usual_(settings.substeps),
      tick_weight_(weight_of(settings.gravity) * settings.time_step),
      fall_(std::max(1.0, tick_weight_ * settings.time_step / kUsualFall)) {}

int ContactNeeds::for_load(double load_ratio) const {
  if (load_ratio <= kLightLoad) return std::max(2, usual_ / 2);
  int substeps = usual_;
  for (double most = kUsualLoad; load_ratio > most && 2 * substeps <= kSubstepsMax; most *= 4) substeps *= 2;
  return substeps;
}

int ContactNeeds::least() const { return adapts_ ? for_load(0) : usual_; }

int ContactNeeds::substeps(const ContactNeed& need, double rests_on, double speed) const {
  if (!adapts_) return usual_;
  double load = rests_on > kLightLoad ? rests_on * fall_ : 0;
  int substeps = need.substeps;
  if (need.ticks < ContactNeed::kTicksToKnow) {
    substeps = usual_;
    load = std::max(load, speed < tick_weight_ ? kLoadAtRest * fall_ : fall_);
  }
  return std::max(substeps, for_load(load));
}

void ContactNeeds::note(ContactNeed& need, double impulse, double inverse_mass) const {
  if (!adapts_) return;
  const double sustained = std::min(need.impulse, impulse);
  need.impulse = impulse;
  const bool was_known = need.ticks == ContactNeed::kTicksToKnow;
  if (!was_known && ++need.ticks < ContactNeed::kTicksToKnow) return;
  const double load_ratio = std::max(0.0, sustained * inverse_mass / tick_weight_ - 1) * fall_;
  const auto wanted = static_cast<std::uint8_t>(for_load(load_ratio));
  if (!was_known || wanted > need.substeps) {
    need.substeps = wanted;
  } else {
    need.substeps = std::min(need.substeps, static_cast<std::uint8_t>(for_load(load_ratio * kReluctance)));
  }
}

int ContactNeeds::for_turn(double turn) const {
  int substeps = usual_;
  if (!adapts_) return substeps;
  for (double most = kTurnMax * usual_; turn > most && 2 * substeps <= kSubstepsMax; most *= 2) substeps *= 2;
  return substeps;
}

}  // namespace tessera::native
