#include "worlds/loader/sdf_parser.h"

#include <absl/base/thread_annotations.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
#include <absl/synchronization/mutex.h>
#include <console_bridge/console.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <sdf/Console.hh>
#include <sdf/ParserConfig.hh>
#include <sdf/SDFImpl.hh>
#include <sdf/parser.hh>
#include <sstream>
#include <vector>

#include "worlds/loader/simulated_elements.h"

namespace tessera {
namespace {

// libsdformat's console and its URDF reader are global variables.
absl::Mutex& parser_mutex() {
  static absl::Mutex mutex;
  return mutex;
}

// Captures the output of libsdformat and urdfdom while it lives.
class Console : public console_bridge::OutputHandler {
 public:
  Console() {
    sdf::Console::Instance()->GetMsgStream().SetStream(&sdformat_);
    console_bridge::useOutputHandler(this);
  }
  ~Console() override {
    sdf::Console::Instance()->GetMsgStream().SetStream(nullptr);
    console_bridge::restorePreviousOutputHandler();
  }
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) urdf_.push_back(text);
  }

  // The messages of one kind, "Error" or "Warning", without colours and places in libsdformat's source.
  std::vector<std::string> messages(absl::string_view kind) const {
    std::vector<std::string> result;
    bool wanted = false;
    for (absl::string_view line : absl::StrSplit(sdformat_.str(), '\n')) {
      const bool begins = absl::StrContains(line, "Error [") || absl::StrContains(line, "Warning [") ||
                          absl::StrContains(line, "Debug [");
      if (begins) wanted = absl::StrContains(line, absl::StrCat(kind, " ["));
      if (!wanted) continue;
      if (const std::size_t end = line.find("\033[0m"); end != absl::string_view::npos)
        line = line.substr(end + 4);
      line = absl::StripAsciiWhitespace(line);
      // A text that is not valid SDF is then tried as URDF and as an old format; messages of those attempts
      // confuse.
      if (line.empty() || absl::StrContains(line, "parseURDF") || absl::StrContains(line, "old deprecated"))
        continue;
      result.emplace_back(line);
    }
    return result;
  }
  const std::vector<std::string>& urdf_errors() const { return urdf_; }

 private:
  std::ostringstream sdformat_;
  std::vector<std::string> urdf_;
};

// libsdformat's description of SDF takes 50 ms to read, and is the same for each document.
const sdf::SDF& description() {
  static const sdf::SDFPtr parsed = [] {
    auto result = std::make_shared<sdf::SDF>();
    sdf::init(result);
    return result;
  }();
  return *parsed;
}

// What is kept of an element's description.
enum class Kept { kNothing, kName, kAll };
using Selection = std::function<Kept(const sdf::Element& element, const std::string& parent)>;

// libsdformat copies the description of an element, with those of all that it may contain, for each element
// that it reads. Nearly all of that is what models have been cleaned of before (simulated_elements.h), most
// of all the sensors of links and joints.
//
// The description, without its texts, and of what `selection` keeps. Where this is the name, with its
// attributes, what is in such an element is taken as it stands.
sdf::ElementPtr cut(const sdf::Element& full, Kept kept, const Selection& selection) {
  auto slim = std::make_shared<sdf::Element>();
  slim->SetName(full.GetName());
  slim->SetRequired(full.GetRequired());
  for (const sdf::ParamPtr& attribute : full.GetAttributes()) {
    slim->AddAttribute(attribute->GetKey(), attribute->GetTypeName(), attribute->GetDefaultAsString(),
                       attribute->GetRequired());
  }
  if (kept == Kept::kName) {
    slim->SetCopyChildren(true);
    return slim;
  }
  slim->SetCopyChildren(full.GetCopyChildren());
  slim->SetReferenceSDF(full.ReferenceSDF());
  if (const sdf::ParamPtr value = full.GetValue()) {
    slim->AddValue(value->GetTypeName(), value->GetDefaultAsString(), value->GetRequired(),
                   value->GetMinValueAsString().value_or(""), value->GetMaxValueAsString().value_or(""));
  }
  for (unsigned n = 0; n < full.GetElementDescriptionCount(); ++n) {
    const sdf::Element& child = *full.GetElementDescription(n);
    const Kept of_child = selection(child, full.GetName());
    if (of_child != Kept::kNothing) slim->AddElementDescription(cut(child, of_child, selection));
  }
  return slim;
}

void collect_words(const sdf::Element& description, absl::string_view parent,
                   std::vector<std::string>& words) {
  for (unsigned n = 0; n < description.GetElementDescriptionCount(); ++n) {
    const sdf::Element& child = *description.GetElementDescription(n);
    if (description.GetName() == parent) words.push_back(child.GetName());
    collect_words(child, parent, words);
  }
}

sdf::SDFPtr document_of(const sdf::Element& description) {
  auto document = std::make_shared<sdf::SDF>();
  document->Root(description.Clone());
  return document;
}

bool has_element(absl::string_view xml, const std::string& name) {
  const std::string start = absl::StrCat("<", name);
  for (std::size_t at = xml.find(start); at != absl::string_view::npos; at = xml.find(start, at + 1)) {
    const std::size_t end = at + start.size();
    if (end < xml.size() && absl::StrContains(" \t\r\n/>", xml.substr(end, 1))) return true;
  }
  return false;
}

// For a model that has been cleaned: elements that it does not have are left out, but for those that every
// model gets, and for values that are simulated, whose defaults count.
sdf::SDFPtr document_of_physics(absl::string_view xml) {
  static const sdf::ElementPtr slim =
      cut(*description().Root(), Kept::kAll, [](const sdf::Element& element, const std::string&) {
        return is_no_physics(element.GetName()) ? Kept::kNothing : Kept::kAll;
      });
  std::map<std::string, bool> found;
  return document_of(*cut(*slim, Kept::kAll, [&](const sdf::Element& element, const std::string& parent) {
    const std::string name = element.GetName();
    const bool is_required = element.GetRequired() != "0" && element.GetRequired() != "*";
    if (is_required || is_simulated(parent, name)) return Kept::kAll;
    const auto [known, is_new] = found.try_emplace(name, false);
    if (is_new) known->second = has_element(xml, name);
    return known->second ? Kept::kAll : Kept::kNothing;
  }));
}

// For models that are converted as text, and not read yet.
sdf::SDFPtr document_of_text() {
  static const sdf::ElementPtr slim =
      cut(*description().Root(), Kept::kAll, [](const sdf::Element& element, const std::string&) {
        return element.GetName() == "model" || element.GetName() == "world" ? Kept::kName : Kept::kAll;
      });
  return document_of(*slim);
}

sdf::ParserConfig config() {
  sdf::ParserConfig result;
  result.SetWarningsPolicy(sdf::EnforcementPolicy::LOG);
  return result;
}

// The most useful errors, few enough to read.
absl::Status failure(const sdf::Errors& errors, const Console& console, bool urdf) {
  constexpr std::size_t kMessagesMax = 4;
  std::vector<std::string> texts = console.messages("Error");
  for (const sdf::Error& error : errors) {
    // Each ancestor of a bad element repeats the error; unreadable text is repeated in full.
    if (absl::StartsWith(error.Message(), "Error reading element") && !texts.empty()) continue;
    if (absl::StartsWith(error.Message(), "Unable to read SDF string")) continue;
    texts.push_back(error.Message());
  }
  if (urdf) texts.insert(texts.begin(), console.urdf_errors().begin(), console.urdf_errors().end());
  std::vector<std::string> distinct;
  for (const std::string& text : texts) {
    if (std::find(distinct.begin(), distinct.end(), text) == distinct.end()) distinct.push_back(text);
  }
  if (distinct.size() > kMessagesMax) distinct.resize(kMessagesMax);
  if (distinct.empty()) distinct.emplace_back("it is neither SDF nor URDF");
  return absl::InvalidArgumentError(absl::StrCat("libsdformat: ", absl::StrJoin(distinct, "; ")));
}

bool is_urdf(absl::string_view xml) { return absl::StrContains(xml.substr(0, 4096), "<robot"); }

absl::Status read(const std::string& xml, const Console& console, const sdf::SDFPtr& document) {
  sdf::Errors errors;
  bool ok = sdf::readString(xml, config(), document, errors);
  ok = ok && errors.empty() && console.messages("Error").empty();
  return ok ? absl::OkStatus() : failure(errors, console, is_urdf(xml));
}

}  // namespace

const std::string& latest_sdf_version() {
  static const std::string version = sdf::SDF::Version();
  return version;
}

sdf::ElementConstPtr sdf_description(const std::string& name) {
  const absl::MutexLock lock(&parser_mutex());
  const sdf::ElementPtr root = description().Root();
  if (name == "sdf") return root;
  const sdf::ElementPtr world = root->GetElementDescription("world");
  return name == "world" ? world : world->GetElementDescription(name);
}

std::vector<std::string> sdf_words_in(absl::string_view parent) {
  const absl::MutexLock lock(&parser_mutex());
  std::vector<std::string> words;
  collect_words(*description().Root(), parent, words);
  return words;
}

absl::Status parse_sdf(const std::string& xml, sdf::Root& root, Notices& notices) {
  const absl::MutexLock lock(&parser_mutex());
  const sdf::SDFPtr document = document_of_physics(xml);
  const Console console;
  if (absl::Status status = read(xml, console, document); !status.ok()) return status;
  const sdf::Errors errors = root.Load(document, config());
  if (!errors.empty()) return failure(errors, console, false);
  for (const std::string& warning : console.messages("Warning")) {
    notices.count(absl::StrCat("warning of libsdformat: ", warning));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> to_latest_sdf(const std::string& xml) {
  const absl::MutexLock lock(&parser_mutex());
  const sdf::SDFPtr document = document_of_text();
  const Console console;
  sdf::Errors errors;
  if (!sdf::readString(xml, config(), document, errors) || !errors.empty()) {
    return failure(errors, console, is_urdf(xml));
  }
  return document->Root()->ToString("");
}

sdf::ElementPtr find_element(sdf::ElementPtr element, std::initializer_list<const char*> path) {
  for (const char* name : path) {
    if (element == nullptr || !element->HasElement(name)) return nullptr;
    element = element->GetElement(name);
  }
  return element;
}

}  // namespace tessera
