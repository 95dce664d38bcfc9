#include "lpss/tick/programs.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <tuple>
#include <utility>

#include "lpss/model/gravity.h"
#include "lpss/model/shape.h"
#include "lpss/observe/contacts.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/packing.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

std::array<double, 3> as_array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d as_vector(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }

// Of the box around a way: whether all are hosted here is looked up one by one.
constexpr double kSectorsLookedAtMax = 1000;

// In which order the parts of one answer come, whoever found them.
bool comes_first(const ProgramFinding& a, const ProgramFinding& b) {
  return std::tie(a.ask, a.distance, a.body, a.impulse, a.normal, a.point) <
         std::tie(b.ask, b.distance, b.body, b.impulse, b.normal, b.point);
}

// Answers questions from what a partition hosts.
class Answering {
 public:
  Answering(Partition& partition, Queries& queries) : partition_(partition), queries_(queries) {}

  // Calls visit(BodyId) with what is in the triggers of a body in sectors of this partition.
  template <typename Visit>
  void for_each_inside(BodyId trigger, const Visit& visit) {
    if (partition_.statics.find(trigger) != nullptr) {
      bring_back_touching(partition_, trigger);
    } else {
      bring_back_holding(partition_, trigger);
    }
    std::vector<BodyId> visitors;
    for (const auto& [index, sector] : partition_.sectors) {
      const auto [first, last] = std::ranges::equal_range(sector->overlaps, trigger, {}, &Overlap::trigger);
      std::transform(first, last, std::back_inserter(visitors), std::mem_fn(&Overlap::visitor));
    }
    // Its motion and place are those of a body that is not packed.
    for (const BodyId visitor : visitors) bring_back_holding(partition_, visitor);
    for (const BodyId visitor : visitors) visit(visitor);
  }

  void answer(std::uint32_t number, const ProgramAsk& ask, ProgramAnswers& answers) {
    std::vector<ProgramFinding>& findings = answers.findings;
    const std::size_t before = findings.size();
    switch (ask.kind) {
      case ProgramAsk::kCast:
        cast(ask, findings);
        break;
      case ProgramAsk::kContacts:
        contacts(ask, findings);
        break;
      case ProgramAsk::kInside:
        inside(ask, findings);
        break;
      case ProgramAsk::kVisitors:
        for_each_inside(ask.body, [&](BodyId visitor) { visited(ask, visitor, findings); });
        break;
      case ProgramAsk::kVisitor:
        visited(ask, ask.body, findings);
        break;
      case ProgramAsk::kJoints:
        for (const JointId id : partition_.joints.of(ask.body)) joint(number, id, ask.sector, answers.joints);
        break;
      case ProgramAsk::kJoint:
        joint(number, ask.joint, ask.sector, answers.joints);
        break;
      default:
        body(ask, findings);
        break;
    }
    for (std::size_t n = before; n < findings.size(); ++n) findings[n].ask = number;
    // All servers leave out alike what is too much.
    std::sort(findings.begin() + static_cast<std::ptrdiff_t>(before), findings.end(), comes_first);
    if (findings.size() > before + kProgramFindingsMax) findings.resize(before + kProgramFindingsMax);
  }

 private:
  void cast(const ProgramAsk& ask, std::vector<ProgramFinding>& findings) {
    const WorldPosition from{ask.sector, as_vector(ask.origin)};
    const Eigen::Vector3d direction = as_vector(ask.direction);
    const QueryFilter filter{ask.mask, {&ask.body, 1}};
    const std::optional<RayAnswer> hit =
        ask.radius > 0 ? queries_.sweep(Sphere{ask.radius}, {from, Eigen::Quaterniond::Identity()}, direction,
                                        ask.length, filter)
                       : queries_.raycast(from, direction, ask.length, filter);
    if (!hit) return;
    ProgramFinding& finding = findings.emplace_back();
    finding.body = hit->body;
    finding.distance = hit->distance;
    finding.normal = as_array(hit->normal);
    const Eigen::Vector3d point =
        as_vector(ask.origin) + direction * hit->distance - hit->normal * ask.radius;
    finding.point = as_array(point);
    describe(finding, ask.sector);
    const Eigen::Vector3d lever = point - as_vector(finding.position);
    finding.velocity =
        as_array(as_vector(finding.velocity) + belt_ + spin_.cross(lever) + running_.cross(lever));
  }

  void contacts(const ProgramAsk& ask, std::vector<ProgramFinding>& findings) {
    for (const TouchingPatch& patch : contacts_of(partition_, {&ask.body, 1})) {
      ProgramFinding& finding = findings.emplace_back();
      const bool is_a = patch.a == ask.body;
      finding.body = is_a ? patch.b : patch.a;
      finding.motion = motion_of(partition_, finding.body);
      const double sign = is_a ? 1 : -1;
      finding.normal = as_array(sign * as_vector(patch.normal));
      finding.impulse = patch.impulse;
      finding.point = as_array(relative_to(patch.position, ask.sector, partition_.sector_size()));
    }
  }

  void inside(const ProgramAsk& ask, std::vector<ProgramFinding>& findings) {
    for_each_inside(ask.body, [&](BodyId visitor) {
      ProgramFinding& finding = findings.emplace_back();
      finding.body = visitor;
      finding.motion = motion_of(partition_, visitor);
    });
  }

  // Its home tells of it.
  void visited(const ProgramAsk& ask, BodyId visitor, std::vector<ProgramFinding>& findings) {
    ProgramFinding finding;
    finding.body = visitor;
    if (!describe(finding, ask.sector) || finding.motion != Motion::kDynamic) return;
    finding.distance = (as_vector(finding.position) - as_vector(ask.origin)).norm();
    finding.is_held = !partition_.joints.of(visitor).empty();
    findings.push_back(finding);
  }

  void joint(std::uint32_t number, JointId id, const SectorIndex& seen_from, std::vector<JointPart>& parts) {
    const JointTie* const tie = partition_.joints.find(id);
    if (tie == nullptr) return;
    JointPart part{number, id, {}, side(tie->parent, seen_from), side(tie->child, seen_from)};
    if (const JointRecord* const record = partition_.joints.record(id)) {
      part.record = *record;
      if (tie->parent.value == 0) {
        part.parent.emplace().pose.position =
            metres_between(seen_from, record->properties.anchor, partition_.sector_size());
      }
    }
    if (part.record || part.parent || part.child) parts.push_back(std::move(part));
  }

  void body(const ProgramAsk& ask, std::vector<ProgramFinding>& findings) {
    ProgramFinding finding;
    finding.body = ask.body;
    if (describe(finding, ask.sector)) findings.push_back(finding);
  }

  // What its home, or everybody of a static body, knows; until the next one is looked up. Null where it lives
  // elsewhere.
  const BodyRecord* known(BodyId body) {
    if (const BodyRecord* const record = partition_.statics.find(body)) return record;
    own_ = body_of(partition_, body);
    return own_ ? &*own_ : nullptr;
  }

  std::optional<JointSide> side(BodyId body, const SectorIndex& seen_from) {
    const BodyRecord* const record = known(body);
    if (record == nullptr) return std::nullopt;
    JointSide side = side_of(record->state);
    side.pose.position += metres_between(seen_from, record->home, partition_.sector_size());
    return side;
  }

  // False where it lives elsewhere.
  bool describe(ProgramFinding& finding, const SectorIndex& seen_from) {
    spin_ = belt_ = running_ = Eigen::Vector3d::Zero();
    const BodyRecord* const record = known(finding.body);
    if (record == nullptr) return false;
    const BodyState& state = record->state;
    finding.motion = record->properties.motion;
    if (finding.motion == Motion::kDynamic) finding.mass = record->properties.mass;
    finding.position = as_array(metres_between(seen_from, record->home, partition_.sector_size()) +
                                as_vector(state.position));
    finding.rotation = state.rotation;
    finding.velocity = state.linear_velocity;
    spin_ = as_vector(state.angular_velocity);
    if (record->properties.surface) {
      // A belt carries what stands on it.
      const Surface& surface = *record->properties.surface;
      const Eigen::Quaterniond turn =
          quaternion_of(state) * centre_frame(record->properties).orientation.conjugate();
      belt_ = turn * as_vector(surface.velocity);
      running_ = turn * as_vector(surface.running);
    }
    return true;
  }

  Partition& partition_;
  Queries& queries_;
  std::optional<BodyRecord> own_;
  Eigen::Vector3d spin_ = Eigen::Vector3d::Zero();     // of the body described last, rad/s
  Eigen::Vector3d belt_ = Eigen::Vector3d::Zero();     // likewise, m/s, of its surface
  Eigen::Vector3d running_ = Eigen::Vector3d::Zero();  // likewise
};

bool is_finite(std::span<const double> numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

bool runs(const ProgramRecord& record, Activity activity, Tick tick) {
  if (!record.fault.empty()) return false;
  return activity != Activity::kAsleep || (record.wake_at != 0 && record.wake_at <= tick);
}

// Whether a cast goes so far, and along such a way, that it can be looked after.
bool is_proper(const ProgramAsk& ask, double sector_size) {
  if (ask.kind != ProgramAsk::kCast) return true;
  const Eigen::Vector3d direction = as_vector(ask.direction);
  return is_finite(ask.origin) && std::abs(direction.norm() - 1) < 1e-6 && ask.length >= 0 &&
         ask.length <= kProgramCastMax && ask.radius >= 0 && ask.radius <= sector_size / 2;
}

// What all servers have found, as one would have. Of a cast, the nearest counts: a static body may be found
// by several.
void put_in_order(std::vector<ProgramFinding>& findings, std::span<const ProgramAsk> asks) {
  std::sort(findings.begin(), findings.end(), comes_first);
  std::vector<std::size_t> found(asks.size());
  std::erase_if(findings, [&](const ProgramFinding& finding) {
    const bool is_cast = asks[finding.ask].kind == ProgramAsk::kCast;
    return ++found[finding.ask] > (is_cast ? 1 : kProgramFindingsMax);
  });
}

// The joints of which all servers together have told all, in the order of (ask, id).
std::vector<SensedJoint> whole_joints(std::vector<JointPart> parts) {
  std::ranges::sort(parts, {}, [](const JointPart& part) { return std::pair(part.ask, part.joint); });
  std::vector<SensedJoint> joints;
  for (auto part = parts.begin(); part != parts.end();) {
    JointPart whole = std::move(*part);
    while (++part != parts.end() && part->ask == whole.ask && part->joint == whole.joint) {
      if (part->record) whole.record = part->record;
      if (part->parent) whole.parent = part->parent;
      if (part->child) whole.child = part->child;
    }
    if (!whole.record || !whole.parent || !whole.child) continue;
    const JointState state = joint_state(whole.record->properties, *whole.parent, *whole.child);
    joints.push_back({whole.ask, *whole.record, state});
  }
  return joints;
}

void stop(ProgramRecord& record, absl::string_view why, Tick tick) {
  record.fault = absl::StrCat("tick ", tick, ": ", why);
  record.wake_at = 0;
}

}  // namespace

ProgramPhase::ProgramPhase(Partition& partition, Queries& queries, Tick tick, ParallelFor parallel)
    : partition_(partition), queries_(queries), tick_(tick), parallel_(std::move(parallel)) {
  for (Sector* sector : partition_.active) {
    for (HomeBody* body : sector->programmed) add(*body);
  }
  std::ranges::sort(running_, {}, [](const Running& r) { return std::pair(r.body->id, r.place); });
}

void ProgramPhase::add(HomeBody& body) {
  const SectorWorld& world = *body.sector->world;
  const Activity activity = world.activity(body.slot);
  for (std::size_t place = 0; place < body.programs.size(); ++place) {
    ProgramRecord& record = body.programs[place];
    if (!runs(record, activity, tick_)) continue;
    complete(record);
    const Program& program = *find_program(record.kind);
    // Commands may have given the body another motion.
    if (const absl::Status status = program.check(body.properties); !status.ok()) {
      stop(record, status.message(), tick_);
      continue;
    }
    Running& running = running_.emplace_back();
    running.body = &body;
    running.place = place;
    running.reads_others = program.reads_others();
    running.state = world.state(body.slot);
    const SectorIndex& home = body.sector->index;
    const Felt& felt = partition_.felt_in(home);
    running.gravity = felt.at(home, as_vector(running.state.position), true);
    if (felt.turns()) running.gravity += felt.coriolis(as_vector(running.state.linear_velocity));
    running.start =
        metres_between(home, record.start_sector, partition_.sector_size()) + as_vector(record.start);
  }
}

Senses ProgramPhase::senses_of(const Running& running) const {
  const HomeBody& body = *running.body;
  const ProgramRecord& record = body.programs[running.place];
  return {tick_,
          partition_.dt(),
          body.id,
          static_cast<std::uint32_t>(running.place),
          body.sector->index,
          body.properties,
          running.state,
          running.state.activity == Activity::kAsleep,
          running.gravity,
          running.start,
          record.parameters,
          record.inputs,
          running.found.findings,
          running.joints};
}

// Others know of what is near their sectors, and of what their bodies touch and notice.
bool ProgramPhase::concerns_others(const ProgramAsk& ask) const {
  const double size = partition_.sector_size();
  if (ask.kind == ProgramAsk::kBody)
    return !partition_.bodies.contains(ask.body) && partition_.statics.find(ask.body) == nullptr;
  if (ask.kind == ProgramAsk::kJoint) return ask.joint.value != 0 && concerns_others(ask.joint);
  if (ask.kind == ProgramAsk::kJoints) {
    return std::ranges::any_of(partition_.joints.of(ask.body),
                               [this](JointId id) { return concerns_others(id); });
  }
  if (ask.kind != ProgramAsk::kCast) return true;
  const Eigen::Vector3d from = as_vector(ask.origin);
  const Eigen::Vector3d to = from + as_vector(ask.direction) * ask.length;
  const double reach = partition_.margins.reach + ask.radius;
  const auto cell = [&](double x) { return static_cast<std::int64_t>(std::floor(x / size + 0.5)); };
  const Eigen::Vector3d low = from.cwiseMin(to) - Eigen::Vector3d::Constant(reach);
  const Eigen::Vector3d high = from.cwiseMax(to) + Eigen::Vector3d::Constant(reach);
  // Of a long way, whose sectors nobody could look at one by one, others may know.
  if (((high - low) / size).array().ceil().prod() > kSectorsLookedAtMax) return true;
  for (std::int64_t i = cell(low.x()); i <= cell(high.x()); ++i) {
    for (std::int64_t j = cell(low.y()); j <= cell(high.y()); ++j) {
      for (std::int64_t k = cell(low.z()); k <= cell(high.z()); ++k) {
        const absl::StatusOr<SectorIndex> sector = translated(ask.sector, {i, j, k});
        if (sector.ok() && !partition_.hosts(*sector)) return true;
      }
    }
  }
  return false;
}

bool ProgramPhase::concerns_others(JointId joint) const {
  const JointRecord* const record = partition_.joints.record(joint);
  if (record == nullptr) return true;
  return record->parent_motion != Motion::kStatic && !partition_.bodies.contains(record->properties.parent);
}

std::vector<ProgramAsks> ProgramPhase::ask() {
  run_in_pieces(parallel_, running_.size(), kProgramsInPiece, [&](std::size_t n) {
    Running& running = running_[n];
    const ProgramRecord& record = running.body->programs[running.place];
    const Senses senses = senses_of(running);
    Asker asker(senses, running.asks, running.fault);
    find_program(record.kind)->ask(senses, record.values, asker);
  });
  ProgramAsks asks;
  queries_.look_for_strays();
  Answering own(partition_, queries_);
  for (std::size_t r = 0; r < running_.size(); ++r) {
    Running& running = running_[r];
    ProgramRecord& record = running.body->programs[running.place];
    const auto is_fit = [this](const ProgramAsk& ask) { return is_proper(ask, partition_.sector_size()); };
    if (running.asks.size() > kProgramAsksMax || !std::ranges::all_of(running.asks, is_fit)) {
      stop(record, absl::StrCat("it asks more than ", kProgramAsksMax, " questions, or improper ones"),
           tick_);
      running.asks.clear();
    } else if (!running.fault.empty()) {
      stop(record, running.fault, tick_);
      running.asks.clear();
    }
    for (std::uint32_t n = 0; n < running.asks.size(); ++n) {
      own.answer(n, running.asks[n], running.found);
      if (partition_.map.servers() == 1) continue;
      // A pair is known at the home of one of the two: who is told of here, but lives elsewhere, is asked for
      // there.
      if (running.asks[n].kind == ProgramAsk::kVisitors) {
        own.for_each_inside(running.asks[n].body, [&](BodyId visitor) {
          if (motion_of(partition_, visitor) != Motion::kDynamic || partition_.bodies.contains(visitor))
            return;
          ProgramAsk& ask = asks.asks.emplace_back(running.asks[n]);
          ask.kind = ProgramAsk::kVisitor;
          ask.body = visitor;
          asked_.push_back({r, n});
        });
      }
      if (!concerns_others(running.asks[n])) {
        if (running.asks[n].kind == ProgramAsk::kCast) kept_.push_back({r, n});
        continue;
      }
      asks.asks.push_back(running.asks[n]);
      asked_.push_back({r, n});
    }
  }
  asks.anybody_asks = !asks.asks.empty();
  asks.has_strays = queries_.has_strays();
  return to_others(asks);
}

std::vector<ProgramAsks> ProgramPhase::to_others(const ProgramAsks& asks) const {
  std::vector<ProgramAsks> outbox(partition_.map.servers(), asks);
  outbox[partition_.self].asks.clear();
  return outbox;
}

bool ProgramPhase::take(std::vector<ProgramAsks> asked) {
  const bool is_first = asked_of_us_.empty();
  if (is_first) {
    asked_of_us_ = std::move(asked);
    return partition_.map.servers() > 1 && std::ranges::any_of(asked_of_us_, &ProgramAsks::has_strays);
  }
  for (std::size_t rank = 0; rank < asked.size(); ++rank) {
    asked_of_us_[rank].anybody_asks |= asked[rank].anybody_asks;
    std::ranges::move(asked[rank].asks, std::back_inserter(asked_of_us_[rank].asks));
  }
  return false;
}

std::vector<ProgramAsks> ProgramPhase::ask_everybody() {
  ProgramAsks asks;
  for (const Asked& kept : kept_) asks.asks.push_back(running_[kept.running].asks[kept.ask]);
  asks.anybody_asks = !asks.asks.empty();
  asked_.insert(asked_.end(), kept_.begin(), kept_.end());
  return to_others(asks);
}

bool ProgramPhase::are_asked() const { return std::ranges::any_of(asked_of_us_, &ProgramAsks::anybody_asks); }

std::vector<ProgramAnswers> ProgramPhase::answer() {
  std::vector<ProgramAnswers> outbox(asked_of_us_.size());
  Answering answering(partition_, queries_);
  for (std::size_t rank = 0; rank < asked_of_us_.size(); ++rank) {
    const std::vector<ProgramAsk>& asks = asked_of_us_[rank].asks;
    for (std::uint32_t n = 0; n < asks.size(); ++n) {
      if (is_proper(asks[n], partition_.sector_size())) answering.answer(n, asks[n], outbox[rank]);
    }
  }
  return outbox;
}

ProgramActs ProgramPhase::run(std::span<const ProgramAnswers> answers) {
  for (const ProgramAnswers& some : answers) {
    for (ProgramFinding finding : some.findings) {
      if (finding.ask >= asked_.size()) continue;
      const Asked& asked = asked_[finding.ask];
      finding.ask = asked.ask;
      running_[asked.running].found.findings.push_back(finding);
    }
    for (JointPart part : some.joints) {
      if (part.ask >= asked_.size()) continue;
      const Asked& asked = asked_[part.ask];
      part.ask = asked.ask;
      running_[asked.running].found.joints.push_back(std::move(part));
    }
  }
  for (const bool reads_others : {false, true}) {
    if (std::ranges::find(running_, reads_others, &Running::reads_others) == running_.end()) continue;
    run_in_pieces(parallel_, running_.size(), kProgramsInPiece, [&](std::size_t n) {
      if (running_[n].reads_others == reads_others) act(running_[n]);
    });
  }
  ProgramActs acts;
  for (Running& running : running_) {
    for (Command& command : running.commands) {
      acts.acts.push_back({running.body->id, static_cast<std::uint8_t>(running.place), std::move(command)});
    }
  }
  return acts;
}

void ProgramPhase::act(Running& running) {
  ProgramRecord& record = running.body->programs[running.place];
  if (!record.fault.empty()) return;
  put_in_order(running.found.findings, running.asks);
  running.joints = whole_joints(std::move(running.found.joints));
  record.wake_at = 0;
  Senses senses = senses_of(running);
  if (running.reads_others) senses.programs = running.body->programs;
  Actor actor(senses, partition_.sector_size(), running.commands, record.wake_at, running.fault);
  find_program(record.kind)->run(senses, record.values, actor);
  if (running.commands.size() > kProgramActsMax) {
    stop(record, absl::StrCat("it acts more than ", kProgramActsMax, " times in a tick"), tick_);
  } else if (!running.fault.empty()) {
    stop(record, running.fault, tick_);
  } else if (!is_finite(record.values)) {
    stop(record, "a value is not finite", tick_);
  }
  if (record.fault.empty()) return;
  running.commands.clear();
  for (double& value : record.values) value = std::isfinite(value) ? value : 0;
}

std::vector<Command> collected_acts(std::vector<ProgramActs>& acts) {
  std::vector<ProgramAct> all;
  for (ProgramActs& some : acts) std::ranges::move(some.acts, std::back_inserter(all));
  std::ranges::stable_sort(all, {}, [](const ProgramAct& act) { return std::pair(act.by, act.program); });
  std::vector<Command> commands;
  commands.reserve(all.size());
  for (ProgramAct& act : all) commands.push_back(std::move(act.command));
  return commands;
}

void append_wakes(std::vector<BodyId> triggers, ProgramActs& acts) {
  std::ranges::sort(triggers);
  const auto again = std::ranges::unique(triggers);
  triggers.erase(again.begin(), again.end());
  for (const BodyId trigger : triggers)
    acts.acts.push_back({trigger, 0, TellProgram{trigger, kAllPrograms, {}, {}}});
}

bool awaits_programs(const Sector& sector) {
  return std::ranges::any_of(sector.programmed, [](const HomeBody* body) {
    return std::ranges::any_of(body->programs,
                               [](const ProgramRecord& record) { return record.wake_at != 0; });
  });
}

}  // namespace tessera
