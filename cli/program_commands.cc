// Programs of a running world: programs, tell.
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/connection.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"

namespace tessera::cli {
namespace {

std::string text_of(const std::vector<NamedNumber>& numbers) {
  std::string text;
  for (const NamedNumber& number : numbers) absl::StrAppendFormat(&text, " %s=%g", number.name, number.value);
  return text;
}

nlohmann::json json_of(const std::vector<NamedNumber>& numbers) {
  nlohmann::json json = nlohmann::json::object();
  for (const NamedNumber& number : numbers) json[number.name] = number.value;
  return json;
}

// "ranger", or "ranger front" with a name.
std::string title_of(const FoundProgram& program) {
  return program.name.empty() ? program.kind : absl::StrCat(program.kind, " ", program.name);
}

void print(const FoundPrograms& found, nlohmann::json& data) {
  data["programs"] = nlohmann::json::array();
  data["truncated"] = found.truncated;
  for (const FoundProgram& program : found.programs) {
    data["programs"].push_back({{"body", program.body.value},
                                {"name", program.body_name},
                                {"program", program.program},
                                {"kind", program.kind},
                                {"program_name", program.name},
                                {"parameters", json_of(program.parameters)},
                                {"inputs", json_of(program.inputs)},
                                {"values", json_of(program.values)},
                                {"fault", program.fault}});
    absl::PrintF("%-24s %d  %s\n  parameters%s\n  inputs%s\n  values%s\n", program.body_name, program.program,
                 title_of(program), text_of(program.parameters), text_of(program.inputs),
                 text_of(program.values));
    if (!program.fault.empty()) absl::PrintF("  stopped: %s\n", program.fault);
  }
  if (found.programs.empty()) absl::PrintF("no programs\n");
  if (found.truncated) absl::PrintF("... and more\n");
}

void add_programs(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "programs", "List programs with their values, by body.", "tessera programs");
  const auto query = std::make_shared<ProgramsQuery>();
  command.add_option("prefix", query->prefix, "of the names of bodies; all if not given");
  command.add_option("--limit", query->limit, "how many at most; 0: 1000");
  on_cluster(command, action, [query](Client& client, nlohmann::json& data) -> absl::Status {
    QueryList queries;
    const auto place = queries.programs(*query);
    const absl::StatusOr<Answers> answers = client.ask(queries);
    if (!answers.ok()) return answers.status();
    print((*answers)[place], data);
    return absl::OkStatus();
  });
}

absl::StatusOr<NamedNumber> parse_number(const std::string& text) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits('=', 1));
  NamedNumber number{parts.first, 0};
  if (absl::SimpleAtod(parts.second, &number.value)) return number;
  return absl::InvalidArgumentError(absl::StrCat("'", text, "' must be NAME=NUMBER"));
}

// The place of the program of a body that is called so, or else of the only one of this kind.
absl::StatusOr<std::uint32_t> find_place(Client& client, const BodyName& body, const std::string& program) {
  std::uint32_t place = 0;
  if (absl::SimpleAtoi(program, &place)) return place;
  const auto* const id = std::get_if<BodyId>(&body);
  const auto* const name = std::get_if<std::string>(&body);
  ProgramsQuery wanted;
  if (id != nullptr) wanted.ids = {*id};
  if (name != nullptr) wanted.prefix = *name;
  QueryList queries;
  const auto query = queries.programs(wanted);
  const absl::StatusOr<Answers> answers = client.ask(queries);
  if (!answers.ok()) return answers.status();
  std::vector<std::uint32_t> named;
  std::vector<std::uint32_t> of_kind;
  std::vector<std::string> words;
  for (const FoundProgram& found : (*answers)[query].programs) {
    if (name != nullptr && found.body_name != *name) continue;
    if (found.name == program) named.push_back(found.program);
    if (found.kind == program) of_kind.push_back(found.program);
    words.push_back(absl::StrCat(found.program, " (", title_of(found), ")"));
  }
  const std::vector<std::uint32_t>& places = named.empty() ? of_kind : named;
  if (places.size() == 1) return places.front();
  return absl::NotFoundError(absl::StrCat(places.empty() ? "no" : "more than one",
                                          " program of the body is called \"", program,
                                          "\"; it has: ", absl::StrJoin(words, ", ")));
}

void add_tell(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "tell", "Set inputs and parameters of a program.",
                                  "tessera tell walker x=1.4 heading=0");
  struct Options {
    std::string body;
    std::vector<std::string> numbers;
    std::string program = "0";
  };
  const auto options = std::make_shared<Options>();
  command.add_option("body", options->body, "its name, or its id")->required();
  command.add_option("numbers", options->numbers, "NAME=NUMBER, one or more")->required();
  command.add_option("--program", options->program, "its name, its kind, or its place on the body, from 0");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) -> absl::Status {
    std::vector<NamedNumber> numbers;
    for (const std::string& text : options->numbers) {
      absl::StatusOr<NamedNumber> number = parse_number(text);
      if (!number.ok()) return number.status();
      numbers.push_back(*std::move(number));
    }
    const BodyName body = parse_body(options->body);
    const absl::StatusOr<std::uint32_t> place = find_place(client, body, options->program);
    if (!place.ok()) return place.status();
    CommandList commands;
    commands.tell_program(body, numbers, *place);
    const absl::StatusOr<Applied> applied = client.apply(commands);
    return print_effect(applied.ok() ? absl::StatusOr<Tick>(applied->tick) : applied.status(), data);
  });
}

}  // namespace

absl::StatusOr<ProgramRecord> parse_program(const std::string& text, ProgramModules& modules) {
  constexpr absl::string_view kName = "name=";
  std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits(':', 1));
  if (absl::EndsWith(parts.first, ".wasm")) {
    absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module_file(parts.first);
    if (!module.ok()) return module.status();
    parts.first = (*module)->kind;
    modules.push_back(*std::move(module));
  }
  absl::StatusOr<ProgramRecord> record = new_program(parts.first);
  if (!record.ok()) return record;
  for (const std::string& word :
       std::vector<std::string>(absl::StrSplit(parts.second, ',', absl::SkipEmpty()))) {
    if (absl::StartsWith(word, kName)) {
      record->name = word.substr(kName.size());
      continue;
    }
    const absl::StatusOr<NamedNumber> number = parse_number(word);
    if (!number.ok()) return number.status();
    if (absl::Status status = set_number(*record, number->name, number->value); !status.ok()) return status;
  }
  return record;
}

void add_program_commands(CLI::App& app, Action& action) {
  add_programs(app, action);
  add_tell(app, action);
}

}  // namespace tessera::cli
