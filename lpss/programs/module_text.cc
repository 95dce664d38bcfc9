#include "lpss/programs/module_text.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "lpss/base/utf8.h"
#include "lpss/model/checks.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

using Words = std::vector<std::string>;

constexpr std::size_t kNameMax = 64;
constexpr std::size_t kTextMax = 1024;

bool is_name(absl::string_view text) {
  return !text.empty() && text.size() <= kNameMax &&
         absl::ascii_islower(static_cast<unsigned char>(text[0])) &&
         std::ranges::all_of(text, [](unsigned char c) {
           return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '_';
         });
}

absl::Status check_name(const std::string& name) {
  if (is_name(name)) return absl::OkStatus();
  return refused("the name '", name.substr(0, kNameMax),
                 "' must be 1 to 64 lower-case letters, digits and '_', and begin with a letter");
}

absl::Status check_text(const std::string& text) {
  if (text.size() > kTextMax) return refused("a text must have at most ", kTextMax, " bytes");
  const bool is_plain = std::ranges::none_of(text, [](unsigned char c) { return absl::ascii_iscntrl(c); });
  if (!is_plain || !is_utf8(text)) return refused("a text must be UTF-8 without control characters");
  return absl::OkStatus();
}

absl::StatusOr<double> number(const std::string& text) {
  double value = 0;
  if (!absl::SimpleAtod(text, &value) || !std::isfinite(value))
    return refused("'", text.substr(0, kNameMax), "' must be a number");
  return value;
}

class Lines {
 public:
  absl::Status take(const Words& words) {
    for (const std::string& word : words) {
      if (absl::Status status = check_text(word); !status.ok()) return status;
    }
    const std::string& kind = words.front();
    if (kind == "program") return take_program(words);
    if (kind == "motion") return take_motion(words);
    if (kind == "parameter") return take_number(words, text_.parameters);
    if (kind == "input") return take_number(words, text_.inputs);
    if (kind == "value") return take_value(words);
    return refused("'", kind.substr(0, kNameMax), "' must be program, motion, parameter, input or value");
  }

  absl::StatusOr<ModuleText> finish() {
    if (text_.name.empty()) return refused("a line must begin with 'program |'");
    return std::move(text_);
  }

 private:
  static absl::Status check_count(const Words& words, std::size_t count, const char* form) {
    if (words.size() == count) return absl::OkStatus();
    return refused("it has ", words.size(), " fields, and must be '", form, "'");
  }

  absl::Status take_program(const Words& words) {
    if (absl::Status status = check_count(words, 3, "program | name | summary"); !status.ok()) return status;
    if (!text_.name.empty()) return refused("a module must have one program");
    if (absl::Status status = check_name(words[1]); !status.ok()) return status;
    text_.name = words[1];
    text_.summary = words[2];
    return absl::OkStatus();
  }

  absl::Status take_motion(const Words& words) {
    if (absl::Status status = check_count(words, 2, "motion | dynamic or kinematic"); !status.ok())
      return status;
    for (const Motion motion : {Motion::kDynamic, Motion::kKinematic}) {
      if (words[1] == name_of(motion)) text_.motion = motion;
    }
    if (text_.motion) return absl::OkStatus();
    return refused("'", words[1].substr(0, kNameMax), "' must be dynamic or kinematic");
  }

  absl::Status add(ModuleNumber number, std::vector<ModuleNumber>& table) {
    if (absl::Status status = check_name(number.name); !status.ok()) return status;
    if (number.name == "kind" || number.name == "module")
      return refused("a number must not have the name '", number.name, "'");
    if (table.size() == kProgramNumbersMax)
      return refused("there must be at most ", kProgramNumbersMax, " of a kind");
    const auto is_there = [&](const std::vector<ModuleNumber>& numbers) {
      return std::ranges::find(numbers, number.name, &ModuleNumber::name) != numbers.end();
    };
    const bool is_value = &table == &text_.values;
    if (is_value ? is_there(text_.values) : is_there(text_.parameters) || is_there(text_.inputs))
      return refused("the name '", number.name, "' is given twice");
    table.push_back(std::move(number));
    return absl::OkStatus();
  }

  absl::Status take_number(const Words& words, std::vector<ModuleNumber>& table) {
    const bool is_input = &table == &text_.inputs;
    if (absl::Status status =
            check_count(words, 7,
                        is_input ? "input | name | unit | first | least | most | meaning"
                                 : "parameter | name | unit | first | least | most | meaning");
        !status.ok())
      return status;
    std::array<double, 3> numbers{};
    for (std::size_t n = 0; n < numbers.size(); ++n) {
      const absl::StatusOr<double> value = number(words[3 + n]);
      if (!value.ok()) return value.status();
      numbers[n] = *value;
    }
    if (absl::Status status = bounded(words[1], numbers[0], numbers[1], numbers[2]); !status.ok())
      return status;
    return add({words[1], words[2], numbers[0], numbers[1], numbers[2], words[6]}, table);
  }

  absl::Status take_value(const Words& words) {
    if (absl::Status status = check_count(words, 5, "value | name | unit | first | meaning"); !status.ok())
      return status;
    const absl::StatusOr<double> first = number(words[3]);
    if (!first.ok()) return first.status();
    return add({words[1], words[2], *first, 0, 0, words[4]}, text_.values);
  }

  ModuleText text_;
};

}  // namespace

// Compilers end texts with a zero: so may lines.
absl::StatusOr<ModuleText> read_module_text(const std::string& text) {
  Lines lines;
  std::size_t line = 0;
  for (const absl::string_view given : absl::StrSplit(text, absl::ByAnyChar(absl::string_view("\n\0", 2)))) {
    ++line;
    if (absl::StripAsciiWhitespace(given).empty()) continue;
    Words words;
    for (const absl::string_view word : absl::StrSplit(given, '|'))
      words.emplace_back(absl::StripAsciiWhitespace(word));
    if (absl::Status status = lines.take(words); !status.ok())
      return in(absl::StrCat("description, line ", line), status);
  }
  absl::StatusOr<ModuleText> result = lines.finish();
  if (!result.ok()) return in("description", result.status());
  return result;
}

}  // namespace tessera
