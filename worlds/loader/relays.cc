#include "worlds/loader/relays.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

using gazebo::Publication;

constexpr char kPublisher[] = "<plugin> triggered publisher";

// Which value of a program a field of its messages is.
struct Field {
  absl::string_view kind;
  absl::string_view field;  // empty: of any message
  absl::string_view value;
};
constexpr std::array kFields = {
    Field{"touch", "", "touches"},
    Field{"touch", "data", "touches"},
    Field{"pad", "", "count"},
    Field{"pad", "state", "count"},
    Field{"altimeter", "vertical_position", "height"},
    Field{"altimeter", "vertical_velocity", "climb"},
    Field{"barometer", "pressure", "pressure"},
    Field{"pose", "pose.position.x", "x"},
    Field{"pose", "pose.position.y", "y"},
    Field{"pose", "pose.position.z", "z"},
};

// Values that count: what is more than none is so.
bool is_of_counts(absl::string_view value) { return value == "touches" || value == "count"; }

absl::Status set(ProgramRecord& record, absl::string_view name, double value) {
  const NumberSpec* const spec = find_spec(*find_program(record.kind), name);
  if (absl::Status status = check_number(*spec, value); !status.ok()) return status;
  return set_number(record, name, value);
}

// What a relay waits for.
absl::Status watch(const Publication& publication, const ProgramRecord& said, std::size_t program,
                   ProgramRecord& relay) {
  const auto field = std::ranges::find_if(
      kFields, [&](const Field& one) { return one.kind == said.kind && one.field == publication.field; });
  if (field == kFields.end())
    return absl::InvalidArgumentError(
        absl::StrCat("the field '", publication.field, "' of what the program ", said.kind, " measures"));
  const std::optional<std::uint32_t> value = place_of(field->value, find_program(said.kind)->values());
  absl::Status status = set(relay, "program", static_cast<double>(program));
  status.Update(set(relay, "value", *value));
  if (is_of_counts(field->value)) {
    const bool is_none = publication.wanted.value_or(1) < 1;
    status.Update(set(relay, "least", is_none ? 0 : 1));
    if (is_none) status.Update(set(relay, "most", 0));
    return status;
  }
  const double wanted = publication.wanted.value_or(0);
  status.Update(set(relay, "least", wanted - publication.tolerance));
  status.Update(set(relay, "most", wanted + publication.tolerance));
  return status;
}

// The first input of a program that a message sets, and what they become: nothing where it hears no such one.
struct Told {
  std::uint32_t input = 0;
  std::vector<double> numbers;
};
std::optional<Told> told_by(const Publication& publication, const ProgramRecord& heard) {
  const std::vector<double>& sent = publication.numbers;
  if (heard.kind == "relay") return Told{0, {1}};  // any message
  if (publication.type == "Twist" && sent.size() == 6) {
    const double speed = sent[0];
    const double turn = sent[5];
    if (heard.kind == "velocity_control") return Told{0, sent};
    if (heard.kind == "multicopter") return Told{0, {sent[0], sent[1], sent[2], turn}};
    if (heard.kind == "diff_drive" || heard.kind == "treads") return Told{0, {speed, turn}};
    if (heard.kind != "ackermann") return std::nullopt;
    constexpr double kStands = 1e-3;  // m/s
    const auto wheelbase = place_of("wheelbase", find_program(heard.kind)->parameters());
    const bool stands = std::abs(speed) < kStands;
    const double angle = stands ? 0 : portable::atan2(turn * heard.parameters[*wheelbase] / speed, 1);
    return Told{0, {speed, angle}};
  }
  if (publication.type == "Empty" && heard.kind == "breaker") return Told{0, {1}};
  const bool is_number = publication.type == "Double" || publication.type == "Float";
  if (is_number && (heard.kind == "pid" || heard.kind == "belt")) return Told{0, sent};
  return std::nullopt;
}

// After its topic; one of several that wait for different numbers on one has its number, too.
std::string name_of(const Publication& publication, bool waits_to_be_told) {
  const std::string word = gazebo::last_word(publication.from);
  return waits_to_be_told && publication.wanted ? absl::StrCat(word, "_", *publication.wanted) : word;
}

// Whom a relay tells, and what.
absl::Status tell(const Publication& publication, const ProgramRecord& heard, std::size_t body,
                  std::size_t program, ProgramRecord& relay) {
  const std::optional<Told> told = told_by(publication, heard);
  if (!told)
    return absl::InvalidArgumentError(absl::StrCat("a ", publication.type, " for the program ", heard.kind));
  absl::Status status = set(relay, "body", static_cast<double>(body + 1));
  status.Update(set(relay, "to_program", static_cast<double>(program)));
  status.Update(set(relay, "input", told->input));
  status.Update(set(relay, "count", static_cast<double>(told->numbers.size())));
  status.Update(set(relay, "delay", publication.delay));
  const std::span<const NumberSpec> inputs = find_program(heard.kind)->inputs();
  for (std::size_t n = 0; n < told->numbers.size(); ++n) {
    status.Update(check_number(inputs[told->input + n], told->numbers[n]));
    status.Update(set(relay, absl::StrCat("to_", n + 1), told->numbers[n]));
  }
  return status;
}

}  // namespace

bool Relays::place(const Publication& publication, WorldDescription& world, Notices& notices) {
  std::vector<Place> hearers;
  std::ranges::copy_if(hears_, std::back_inserter(hearers),
                       [&](const Place& place) { return place.topic == publication.at; });
  if (hearers.empty()) return false;
  std::vector<std::optional<Place>> sayers;
  for (const Place& place : says_) {
    if (place.topic == publication.from) sayers.emplace_back(place);
  }
  const bool waits_to_be_told = sayers.empty();
  if (waits_to_be_told) sayers.emplace_back();
  for (const Place& hearer : hearers) {
    for (const std::optional<Place>& sayer : sayers) {
      BodyDescription& body = world.bodies[sayer ? sayer->body : hearer.body];
      ProgramRecord relay = new_program("relay").value();
      relay.name = name_of(publication, waits_to_be_told);
      absl::Status status = tell(publication, world.bodies[hearer.body].programs[hearer.program], hearer.body,
                                 hearer.program, relay);
      if (sayer) status.Update(watch(publication, body.programs[sayer->program], sayer->program, relay));
      if (body.programs.size() >= kProgramsPerBodyMax)
        status.Update(absl::ResourceExhaustedError(
            absl::StrCat(body.name, " has ", kProgramsPerBodyMax, " programs already")));
      if (!status.ok()) {
        notices.count(absl::StrCat(kPublisher, " not simulated: ", status.message()));
        continue;
      }
      if (waits_to_be_told) {
        hears_.push_back({publication.from, sayer ? sayer->body : hearer.body, body.programs.size()});
        notices.count(absl::StrCat(kPublisher, " waits to be told: tessera tell ", body.name, " --program ",
                                   relay.name, " fire=1"));
      } else {
        notices.count(absl::StrCat(kPublisher, " is the program relay"));
      }
      body.programs.push_back(std::move(relay));
    }
  }
  return true;
}

void Relays::place(WorldDescription& world, Notices& notices) {
  for (bool some = true; some;) {
    some = false;
    std::vector<Publication> waiting = std::exchange(waiting_, {});
    for (const Publication& publication : waiting) {
      if (place(publication, world, notices)) {
        some = true;
      } else {
        waiting_.push_back(publication);
      }
    }
  }
  for (const Publication& publication : waiting_)
    notices.count(absl::StrCat(kPublisher, " not simulated: no program hears ", publication.at));
}

}  // namespace tessera
