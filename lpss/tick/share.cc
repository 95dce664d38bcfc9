#include "lpss/tick/share.h"

#include <algorithm>

#include "lpss/base/invariant.h"

namespace tessera {

EngineSettings engine_settings(const WorldSettings& settings) {
  EngineSettings result;
  result.precision = settings.precision;
  const bool clone = settings.seams == SeamPolicy::kClone;
  result.clone_contacts = clone ? CloneContacts::kAll : CloneContacts::kNone;
  result.clones_are_solved = clone;
  result.solver_iterations = settings.solver_iterations;
  result.substeps = settings.substeps;
  result.adapt = settings.adapt;
  // A pull of 0.006 m/s^2 is less than the last digit of 30 km/s in single precision.
  result.fine_flight =
      settings.precision == Precision::kFloat32 && std::holds_alternative<CentralGravity>(settings.gravity);
  result.warm_starting = settings.warm_starting;
  result.split_from = settings.split_from;
  result.friction_in_two_directions = settings.friction_in_two_directions;
  result.continuous_collision = settings.continuous_collision;
  result.sleep_linear_speed = settings.sleep_linear_speed;
  result.sleep_angular_speed = settings.sleep_angular_speed;
  result.sleep_after = settings.sleep_after;
  return result;
}

TickCounts& TickCounts::operator+=(const TickCounts& other) {
  sectors += other.sectors;
  sectors_awake += other.sectors_awake;
  bodies_awake += other.bodies_awake;
  clones += other.clones;
  contacts += other.contacts;
  islands_across_seams += other.islands_across_seams;
  islands_shipped += other.islands_shipped;
  islands_cut += other.islands_cut;
  bodies_stopped += other.bodies_stopped;
  return *this;
}

Share::Share(Options options, Engine& engine)
    : options_(std::move(options)),
      engine_(engine),
      phase_clock_(options_.time),
      margins_(seam_margins(options_.settings.sector_size, options_.settings.time_step, 0)),
      statics_(options_.settings.sector_size),
      solvers_(engine) {}

Share::~Share() = default;

void Share::run_parallel(std::size_t count, const std::function<void(std::size_t)>& body) {
  tessera::run_parallel(options_.parallel, count, body);
}

WorldHash Share::hash() const {
  WorldHash sum;
  for (const auto& [id, body] : bodies_) sum.add(record_of(*body), options_.anchor);
  statics_.for_each([&](const BodyRecord& record) {
    if (mine(record.home)) sum.add(record, options_.anchor);
  });
  return sum;
}

std::optional<BodyRecord> Share::body(BodyId id) const {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return std::nullopt;
  return record_of(*found->second);
}

void Share::for_each_body(const std::function<void(const BodyRecord&)>& visit) const {
  std::vector<BodyId> ids;
  ids.reserve(bodies_.size());
  for (const auto& [id, body] : bodies_) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  for (const BodyId id : ids) visit(record_of(*bodies_.at(id)));
}

void Share::for_each_body(const std::function<bool(const SectorIndex&)>& wants,
                          const std::function<void(const BodyRecord&)>& visit) const {
  for (const auto& [index, sector] : sectors_) {
    if (sector->homes.empty() || !wants(index)) continue;
    for (const HomeBody* body : sector->homes) visit(record_of(*body));
  }
}

void Share::report_contacts(bool on) {
  if (on == report_contacts_) return;
  report_contacts_ = on;
  for (auto& [index, sector] : sectors_) {
    sector->touching.clear();
    if (!on || !sector->world) continue;
    // Contacts that are there already do not begin.
    for (const ContactPair& pair : sector->world->contacts()) {
      if (pair.touching && reports(*sector, pair)) sector->touching.insert({pair.a, pair.b});
    }
  }
}

}  // namespace tessera
