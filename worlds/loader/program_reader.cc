#include "worlds/loader/program_reader.h"

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "lpss/model/limits.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"
#include "worlds/gazebo/program_writer.h"
#include "worlds/loader/file_search.h"
#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

// Between what is kept of a program, and between programs.
constexpr absl::string_view kSeparator = ";";
constexpr absl::string_view kNext = ";;";
constexpr char kKind[] = "kind";
constexpr char kModule[] = "module";
constexpr char kProgramName[] = "name";
constexpr absl::string_view kOfSystem = "?";  // before the kind

// Cameras do nothing but say where they are: they come last, and leave room for what water and wind add.
constexpr absl::string_view kCamera = "camera";
constexpr std::size_t kProgramsBesideCamerasMax = kProgramsPerBodyMax - 2;

// Whether it is the place of a program, value or input.
bool is_place(const NumberSpec& spec) {
  return spec.unit == kProgramUnit || spec.unit == kValueUnit || spec.unit == kInputUnit;
}

// "name=value"
absl::StatusOr<std::string> kept_number(const xml::Element& element, const Program& program,
                                        const char* name) {
  const NumberSpec* const spec = find_spec(program, name);
  if (spec == nullptr) {
    return xml::invalid(element, no_number(program, name));
  }
  if (is_id(*spec)) {
    const std::string named = element.Attribute(name);
    if (named.empty() || absl::StrContains(named, kSeparator))
      return xml::invalid(element, "'", name, "' must be the name of a ", spec->unit, ", without ';'");
    return absl::StrCat(name, "=", named);
  }
  double number = 0;
  if (is_place(*spec) && !absl::SimpleAtod(element.Attribute(name), &number)) {
    if (absl::StrContains(element.Attribute(name), kSeparator))
      return xml::invalid(element, "'", name, "' must be the name or place of a ", spec->unit,
                          ", without ';'");
    return absl::StrCat(name, "=", element.Attribute(name));
  }
  const absl::StatusOr<double> value = xml::number_attribute(element, name);
  if (!value.ok()) return value.status();
  const absl::Status status = check_number(*spec, *value);
  if (!status.ok()) return xml::invalid(element, status.message());
  return absl::StrFormat("%s=%.17g", name, *value);
}

// The kind of the program in a module, which is added where it is new.
absl::StatusOr<std::string> module_kind(const xml::Element& element, const std::filesystem::path& directory,
                                        ProgramModules& modules) {
  const std::string name = element.Attribute(kModule);
  if (element.Attribute(kKind) != nullptr)
    return xml::invalid(element, "a program has a 'kind' or a 'module', not both");
  const absl::StatusOr<std::filesystem::path> file = find_uri(name, directory);
  if (!file.ok()) return xml::error_at(element, file.status().code(), file.status().message());
  absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module_file(*file);
  if (!module.ok()) return xml::error_at(element, module.status().code(), module.status().message());
  std::string kind = (*module)->kind;
  if (std::ranges::find(modules, *module) == modules.end()) modules.push_back(*std::move(module));
  if (modules.size() > kModulesMax)
    return xml::invalid(element, "a world must have at most ", kModulesMax, " modules");
  return kind;
}

absl::StatusOr<std::string> kept_program(const xml::Element& element, const std::filesystem::path& directory,
                                         ProgramModules& modules) {
  const absl::StatusOr<std::string> kind = element.Attribute(kModule) != nullptr
                                               ? module_kind(element, directory, modules)
                                               : xml::required_attribute(element, kKind);
  if (!kind.ok()) return kind.status();
  const Program* const program = find_program(*kind);
  if (program == nullptr) return xml::invalid(element, new_program(*kind).status().message());
  const bool is_of_system = xml::is(element, gazebo::kSystemProgram);
  std::string kept = absl::StrCat(is_of_system ? kOfSystem : "", program->kind());
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
       attribute = attribute->Next()) {
    const absl::string_view name = attribute->Name();
    if (name == kKind || name == kModule) continue;
    if (is_of_system && (name == gazebo::kSays || name == gazebo::kHears || name == gazebo::kPublishes)) {
      absl::StrAppend(&kept, kSeparator, name, "=", attribute->Value());
      continue;
    }
    if (name == kProgramName) {
      if (absl::StrContains(attribute->Value(), kSeparator))
        return xml::invalid(element, "'name' must not have a ';'");
      absl::StrAppend(&kept, kSeparator, kProgramName, "=", attribute->Value());
      continue;
    }
    const absl::StatusOr<std::string> number = kept_number(element, *program, attribute->Name());
    if (!number.ok()) return number.status();
    absl::StrAppend(&kept, kSeparator, *number);
  }
  return kept;
}

// Of what was kept: its names and numbers are right.
void take_number(const Program& program, absl::string_view name, const std::string& text,
                 ProgramTemplate& result) {
  if (name == kProgramName) {
    result.record.name = text;
    return;
  }
  if (name == gazebo::kSays) result.says = text;
  if (name == gazebo::kHears) result.hears = text;
  if (name == gazebo::kPublishes) result.publishes = gazebo::publication_in(text);
  const std::optional<std::uint32_t> parameter = place_of(name, program.parameters());
  double value = 0;
  if (parameter && (is_id(program.parameters()[*parameter]) ||
                    (is_place(program.parameters()[*parameter]) && !absl::SimpleAtod(text, &value)))) {
    result.named.emplace_back(*parameter, text);
    return;
  }
  if (absl::SimpleAtod(text, &value)) set_number(result.record, name, value).IgnoreError();
}

}  // namespace

absl::Status keep_programs(xml::Element& link, const std::filesystem::path& directory,
                           ProgramModules& modules, Notices& notices) {
  std::vector<std::string> kept;
  std::vector<std::string> cameras;
  std::vector<std::string> relays;
  for (const char* const tag : {kProgram.data(), gazebo::kSystemProgram}) {
    while (xml::Element* const next = link.FirstChildElement(tag)) {
      absl::StatusOr<std::string> program = kept_program(*next, directory, modules);
      if (!program.ok()) return program.status();
      if (next->Attribute(gazebo::kPublishes) != nullptr) {
        relays.push_back(*std::move(program));  // which will be programs of other links
      } else if (tag != kProgram && xml::attribute_of(next, kKind) == kCamera) {
        cameras.push_back(*std::move(program));
      } else if (kept.size() < kProgramsPerBodyMax) {
        kept.push_back(*std::move(program));
      } else if (tag == kProgram) {
        return xml::invalid(*next, "a link must have at most ", kProgramsPerBodyMax, " programs");
      } else {
        notices.count(absl::StrCat("program of a link that has ", kProgramsPerBodyMax, " already, left out"));
      }
      link.DeleteChild(next);
    }
  }
  for (std::string& camera : cameras) {
    if (kept.size() < kProgramsBesideCamerasMax) {
      kept.push_back(std::move(camera));
    } else {
      notices.count(absl::StrCat("camera of a link that has ", kProgramsBesideCamerasMax,
                                 " programs already, left out"));
    }
  }
  std::ranges::move(relays, std::back_inserter(kept));
  if (kept.empty()) return absl::OkStatus();
  xml::Element* const all = link.InsertNewChildElement(kProgram.data());
  all->SetText(absl::StrJoin(kept, kNext).c_str());
  return absl::OkStatus();
}

std::vector<ProgramTemplate> programs_of(const sdf::Link& link) {
  std::vector<ProgramTemplate> result;
  std::string text;
  if (!find_value(link.Element(), {kProgram.data()}, text)) return result;
  for (const std::string& kept : std::vector<std::string>(absl::StrSplit(text, kNext))) {
    const std::vector<std::string> words = absl::StrSplit(kept, kSeparator);
    absl::string_view kind = words[0];
    const bool is_of_system = absl::ConsumePrefix(&kind, kOfSystem);
    const Program* const program = find_program(kind);
    absl::StatusOr<ProgramRecord> record = new_program(kind);
    if (!record.ok()) continue;
    ProgramTemplate& entry = result.emplace_back();
    entry.is_of_system = is_of_system;
    entry.record = *std::move(record);
    for (const std::string& word : std::span(words).subspan(1)) {
      const std::pair<std::string, std::string> number = absl::StrSplit(word, absl::MaxSplits('=', 1));
      take_number(*program, number.first, number.second, entry);
    }
  }
  return result;
}

bool is_sensor(absl::string_view kind) {
  constexpr std::array<absl::string_view, 10> kSensors = {
      "altimeter",    "barometer", "camera", "imu",       "logical_camera",
      "magnetometer", "pose",      "ranger", "satellite", "touch"};
  return std::ranges::find(kSensors, kind) != kSensors.end();
}

void ProgramPlacer::add(const std::vector<ProgramTemplate>& programs, const xml::Element& element,
                        std::size_t place, const Eigen::Vector3d& start, BodyDescription& body) {
  // The model of the body, for topics that are named after it.
  const std::string model = body.name.substr(0, body.name.find("::"));
  const auto topic_of = [&](absl::string_view topic) { return absl::StrReplaceAll(topic, {{"*", model}}); };
  for (const ProgramTemplate& program : programs) {
    if (program.publishes) {
      gazebo::Publication publication = *program.publishes;
      publication.from = topic_of(publication.from);
      publication.at = topic_of(publication.at);
      relays_.add(publication);
      continue;
    }
    const std::size_t number = body.programs.size();
    for (const auto& [parameter, name] : program.named)
      named_.push_back({place, number, parameter, name, &element, program.is_of_system});
    if (!program.says.empty()) relays_.note_says(topic_of(program.says), place, number);
    if (!program.hears.empty()) relays_.note_hears(topic_of(program.hears), place, number);
    ProgramRecord& record = body.programs.emplace_back(program.record);
    if (program.is_of_system) surroundings.tell(start, record);
  }
}

void ProgramPlacer::add_publisher(const xml::Element& plugin, Notices& notices) {
  const absl::StatusOr<std::vector<gazebo::Publication>> publications = gazebo::publications_of(plugin);
  if (!publications.ok()) {
    notices.count(
        absl::StrCat("<plugin> triggered publisher not simulated: ", publications.status().message()));
    return;
  }
  for (const gazebo::Publication& publication : *publications) relays_.add(publication);
}

absl::Status ProgramPlacer::resolve(WorldDescription& world, Notices& notices) {
  if (absl::Status status = resolve_ids(world, notices); !status.ok()) return status;
  for (const Named& named : named_) {
    if (absl::Status status = resolve_place(named, world); !status.ok()) return status;
  }
  relays_.place(world, notices);
  return absl::OkStatus();
}

absl::Status ProgramPlacer::resolve_ids(WorldDescription& world, Notices& notices) const {
  if (named_.empty()) return absl::OkStatus();
  using Ids = absl::flat_hash_map<std::string_view, std::uint64_t>;  // 1, 2, ... in their order
  Ids bodies;
  for (const BodyDescription& body : world.bodies) bodies.emplace(body.name, bodies.size() + 1);
  Ids joints;
  for (const JointDescription& joint : world.joints) joints.emplace(joint.name, joints.size() + 1);
  for (const Named& named : named_) {
    BodyDescription& body = world.bodies[named.body];
    ProgramRecord& program = body.programs[named.program];
    const NumberSpec& spec = find_program(program.kind)->parameters()[named.parameter];
    if (!is_id(spec)) continue;
    const Ids& ids = spec.unit == kBodyUnit ? bodies : joints;
    auto id = ids.end();
    // From the model of the body outwards.
    for (std::size_t end = body.name.rfind("::"); id == ids.end() && end != std::string::npos && end > 0;
         end = body.name.rfind("::", end - 1)) {
      id = ids.find(absl::StrCat(body.name.substr(0, end + 2), named.name));
    }
    if (id == ids.end()) id = ids.find(named.name);
    if (id == ids.end() && named.is_of_system) {
      notices.count(
          absl::StrCat("program ", program.kind, " of a ", spec.unit, " that was left out, does nothing"));
      continue;
    }
    if (id == ids.end())
      return xml::invalid(*named.element, "a program names the ", spec.unit, " '", named.name,
                          "', which is not there");
    program.parameters[named.parameter] = static_cast<double>(id->second);
  }
  return absl::OkStatus();
}

// Of the body, and the program, that the parameters before it name; or else of the own body.
absl::Status ProgramPlacer::resolve_place(const Named& named, WorldDescription& world) {
  ProgramRecord& record = world.bodies[named.body].programs[named.program];
  const std::span<const NumberSpec> table = find_program(record.kind)->parameters();
  const NumberSpec& spec = table[named.parameter];
  if (!is_place(spec)) return absl::OkStatus();
  const auto before = [&](absl::string_view unit) -> std::optional<double> {
    for (std::size_t n = named.parameter; n-- > 0;) {
      if (table[n].unit == unit) return record.parameters[n];
    }
    return std::nullopt;
  };
  const double body = before(kBodyUnit).value_or(static_cast<double>(named.body + 1));
  const auto error = [&](absl::string_view why) {
    return xml::invalid(*named.element, "a program names the ", spec.unit, " '", named.name, "', ", why);
  };
  if (body < 1) return error("but no body that has it");
  const std::vector<ProgramRecord>& programs = world.bodies[static_cast<std::size_t>(body) - 1].programs;
  if (spec.unit == kProgramUnit) {
    auto found = std::ranges::find(programs, named.name, &ProgramRecord::name);
    if (found == programs.end()) found = std::ranges::find(programs, named.name, &ProgramRecord::kind);
    if (found == programs.end()) return error("which is not there");
    record.parameters[named.parameter] = static_cast<double>(found - programs.begin());
    return absl::OkStatus();
  }
  const double place = before(kProgramUnit).value_or(0);
  if (place < 0 || place >= static_cast<double>(programs.size())) return error("but no program that has it");
  const Program& program = *find_program(programs[static_cast<std::size_t>(place)].kind);
  const std::optional<std::uint32_t> number =
      place_of(named.name, spec.unit == kValueUnit ? program.values() : program.inputs());
  if (!number) return error(absl::StrCat("which program ", program.kind(), " does not have"));
  record.parameters[named.parameter] = *number;
  return absl::OkStatus();
}

}  // namespace tessera
