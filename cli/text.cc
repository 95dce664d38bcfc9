#include "cli/text.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>

namespace tessera::cli {

std::string grouped(std::uint64_t number) {
  const std::string digits = absl::StrCat(number);
  std::string text;
  for (std::size_t place = 0; place < digits.size(); ++place) {
    if (place > 0 && (digits.size() - place) % 3 == 0) text += ',';
    text += digits[place];
  }
  return text;
}

std::string title_of(const TickCounter& counter) { return absl::StrReplaceAll(counter.name, {{"_", " "}}); }

std::string to_string(const Eigen::Vector3d& vector) {
  return absl::StrFormat("%.3f, %.3f, %.3f", vector.x(), vector.y(), vector.z());
}

std::string in_options(absl::string_view message) {
  constexpr absl::string_view kSet = "set `";
  std::string text;
  for (std::size_t begin = 0; (begin = message.find(kSet)) != absl::string_view::npos;) {
    const absl::string_view rest = message.substr(begin + kSet.size());
    const std::size_t end = rest.find('`');
    if (end == absl::string_view::npos) break;
    absl::StrAppend(&text, message.substr(0, begin), "add --",
                    absl::StrReplaceAll(rest.substr(0, end), {{"_", "-"}}));
    message = rest.substr(end + 1);
  }
  return absl::StrCat(text, message);
}

std::string file_notes(const std::vector<std::string>& notices, const std::vector<std::string>& repairs) {
  std::string text;
  for (const std::string& notice : notices) absl::StrAppend(&text, "note: ", notice, "\n");
  for (const std::string& repair : repairs) absl::StrAppend(&text, "repaired: ", repair, "\n");
  return text;
}

}  // namespace tessera::cli
