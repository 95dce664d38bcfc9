#include "worlds/mjcf/document.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include "lpss/model/limits.h"

namespace tessera::mjcf {
namespace {

using xml::Element;

constexpr char kMainClass[] = "main";

// What changes nothing that moves, and may be large.
constexpr std::array<absl::string_view, 7> kSeenOnly = {"texture", "skin",   "visual", "statistic",
                                                        "size",    "custom", "light"};

// Elements of newer files that stand for bodies.
constexpr std::array<absl::string_view, 5> kBodiesOfNewerFiles = {"attach", "replicate", "flexcomp", "flex",
                                                                  "deformable"};

// Attributes of newer files that count, although MuJoCo 2.2 does not get them.
constexpr std::array<absl::string_view, 4> kKnownHere = {"actuatorfrclimited", "actuatorfrcrange",
                                                         "dampratio", "kv"};

template <typename Names>
bool is_one_of(const Element& element, const Names& names) {
  return std::ranges::find(names, absl::string_view(element.Name())) != names.end();
}

// What stands between `before` and the next `after`; nothing if it is not there.
std::optional<std::string> between(const std::string& text, const std::string& before, char after) {
  const std::size_t start = text.find(before);
  if (start == std::string::npos) return std::nullopt;
  const std::size_t from = start + before.size();
  const std::size_t end = text.find(after, from);
  if (end == std::string::npos) return std::nullopt;
  return text.substr(from, end - from);
}

std::string escaped(absl::string_view value) {
  return absl::StrReplaceAll(
      value, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}, {"\n", " "}, {"\r", " "}});
}

std::vector<double> numbers_of(const Element& element, const char* attribute) {
  std::vector<double> result;
  for (const std::string& word : std::vector<std::string>(absl::StrSplit(
           xml::attribute_of(&element, attribute), absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty()))) {
    double number = 0;
    if (absl::SimpleAtod(word, &number)) result.push_back(number);
  }
  return result;
}

// A <frame> is a body that does not move in the one around it. Where that one says what it weighs, shapes add
// nothing.
void become_body(Element& frame) {
  const Element& around = *frame.Parent()->ToElement();
  if (around.FirstChildElement("inertial") != nullptr) {
    for (Element* geom = frame.FirstChildElement("geom"); geom != nullptr;
         geom = geom->NextSiblingElement("geom"))
      geom->SetAttribute("mass", "0");
  }
  frame.SetName("body");
}

double product_of(const std::vector<double>& numbers) {
  double product = 1;
  for (const double number : numbers) product *= std::max(number, 1.0);
  return product;
}

}  // namespace

// All elements below one, of included files too, from the top down. `visit` may delete none of them.
template <typename Visit>
absl::Status Document::each(Element& parent, const Visit& visit) {
  for (Element* child = parent.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    const auto file = included_.find(child);
    Element& next = file == included_.end() ? *child : file->second->root();
    if (file == included_.end()) {
      if (absl::Status status = visit(next); !status.ok()) return status;
    }
    if (absl::Status status = each(next, visit); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Document::splice(const Element& element, int depth, Notices& notices) {
  const absl::StatusOr<std::string> name = xml::required_attribute(element, "file");
  if (!name.ok()) return name.status();
  if (depth >= kIncludeDepthMax)
    return xml::invalid(element, "includes are nested deeper than ", kIncludeDepthMax);
  absl::StatusOr<std::unique_ptr<xml::File>> file = xml::File::read(std::filesystem::path(folder_) / *name);
  if (absl::IsNotFound(file.status())) {
    notices.count_missing_file(*name, xml::place_of(element), file.status().message());
    return absl::OkStatus();
  }
  if (!file.ok()) return file.status();
  Element& root = (*file)->root();
  if (!xml::is(root, "mujoco") && !xml::is(root, "mujocoinclude"))
    return xml::invalid(root, "the root of an included file must be <mujoco> or <mujocoinclude>");
  xml::File& kept = **file;
  included_.emplace(&element, *std::move(file));
  return include(kept.root(), depth + 1, notices);
}

absl::Status Document::include(Element& parent, int depth, Notices& notices) {
  for (Element* child = parent.FirstChildElement(); child != nullptr;) {
    Element& element = *child;
    child = child->NextSiblingElement();
    absl::Status status;
    if (xml::is(parent, "equality") && element.Attribute("site1") != nullptr) {
      notices.count_loss("equality of sites, not simulated");
      parent.DeleteChild(&element);
    } else if (is_one_of(element, kSeenOnly)) {
      notices.count(absl::StrCat("<", element.Name(), "> skipped"));
      parent.DeleteChild(&element);
    } else if (xml::is(element, "include")) {
      status = splice(element, depth, notices);
    } else {
      status = include(element, depth, notices);
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// A class has the elements of its <default>, and all that its parent has.
void Document::collect_classes(Element& defaults, const std::string& parent) {
  std::string name = xml::attribute_of(&defaults, "class");
  if (name.empty()) name = kMainClass;
  Class& own = classes_[name];
  own.parent = parent;
  for (Element* child = defaults.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (xml::is(*child, "default")) {
      collect_classes(*child, name);
    } else {
      own.elements.push_back(child);
    }
  }
}

// An attribute of an element, or else of its class: its own, that of the bodies around it, or the main one.
std::optional<std::string> Document::inherited(const Element& element, const char* attribute) const {
  if (const char* own = element.Attribute(attribute)) return own;
  std::string name = xml::attribute_of(&element, "class");
  for (const auto* around = element.Parent(); around != nullptr && name.empty(); around = around->Parent())
    name = xml::attribute_of(around->ToElement(), "childclass");
  if (name.empty()) name = kMainClass;
  for (std::size_t steps = 0; steps <= classes_.size(); ++steps) {
    const auto found = classes_.find(name);
    if (found == classes_.end()) return std::nullopt;
    for (const Element* other : found->second.elements) {
      const char* const value = other->Attribute(attribute);
      if (value != nullptr && xml::is(*other, element.Name())) return value;
    }
    name = found->second.parent;
  }
  return std::nullopt;
}

absl::Status Document::amend_size(const Element& element) const {
  if (xml::is(element, "composite")) {
    const double count = product_of(numbers_of(element, "count"));
    if (!(count <= kCompositeElementsMax))
      return xml::invalid(element, "its ", count, " elements must be at most ", kCompositeElementsMax);
  }
  if (xml::is(element, "hfield")) {
    const double samples = product_of(numbers_of(element, "nrow")) * product_of(numbers_of(element, "ncol"));
    if (!(samples <= static_cast<double>(kHeightFieldSamplesMax)))
      return xml::invalid(element, "its ", samples, " samples must be at most ", kHeightFieldSamplesMax);
  }
  return absl::OkStatus();
}

// The file of a mesh or height field must be there, and not too large.
absl::Status Document::amend_file(const Element& element, Notices& notices) const {
  const bool is_mesh = xml::is(element, "mesh");
  const std::string name = xml::attribute_of(&element, "file");
  if (name.empty() || (!is_mesh && !xml::is(element, "hfield"))) return absl::OkStatus();
  std::filesystem::path file = name;
  if (strips_paths_) file = file.filename();
  const std::filesystem::path& folder = is_mesh && !meshes_.empty() ? meshes_ : assets_;
  file = std::filesystem::path(folder_) / folder / file;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) {
    notices.count_missing_file(name, xml::place_of(element),
                               absl::StrCat(file.string(), ": there is no such file"));
    return absl::OkStatus();
  }
  if (bytes <= kWorldFileBytesMax) return absl::OkStatus();
  return xml::invalid(element, "the ", bytes, " bytes of its file must be at most ", kWorldFileBytesMax);
}

// A servo with damping is a general actuator, as MuJoCo 2.2 sees it. A ratio of damping is kept as a
// coefficient above 0, which none has otherwise.
absl::Status Document::amend_servo(Element& element) const {
  if (!xml::is(element, "position") || element.Parent() == nullptr ||
      !xml::is(*element.Parent()->ToElement(), "actuator"))
    return absl::OkStatus();
  const std::optional<std::string> damping = inherited(element, "kv");
  const std::optional<std::string> ratio = inherited(element, "dampratio");
  if (!damping && !ratio) return absl::OkStatus();
  double kp = 1;
  double kv = 0;
  if (const auto given = inherited(element, "kp"); given && !absl::SimpleAtod(*given, &kp))
    return xml::invalid(element, "'kp' must be a number");
  if (!absl::SimpleAtod(damping ? *damping : *ratio, &kv) || !(kv >= 0))
    return xml::invalid(element, "'kv' and 'dampratio' must be numbers of at least 0");
  element.SetName("general");
  for (const char* old : {"kp", "kv", "dampratio"}) element.DeleteAttribute(old);
  element.SetAttribute("gaintype", "fixed");
  element.SetAttribute("biastype", "affine");
  element.SetAttribute("gainprm", absl::StrFormat("%.17g", kp).c_str());
  element.SetAttribute("biasprm", absl::StrFormat("0 %.17g %.17g", -kp, damping ? -kv : kv).c_str());
  return absl::OkStatus();
}

absl::Status Document::amend(Element& element, Notices& notices) {
  if (xml::is(element, "material")) element.DeleteAttribute("texture");
  if (xml::is(element, "frame")) become_body(element);
  if (xml::is(element, "option") && element.Attribute("timestep") != nullptr) has_time_step_ = true;
  if (xml::is(element, "joint")) {
    const std::string name = xml::attribute_of(&element, "name");
    const std::optional<std::string> range = inherited(element, "actuatorfrcrange");
    double bound = 0;
    for (const std::string& word : std::vector<std::string>(absl::StrSplit(range.value_or(""), ' '))) {
      double number = 0;
      if (absl::SimpleAtod(word, &number)) bound = std::max(bound, std::abs(number));
    }
    if (!name.empty() && bound > 0) efforts_[name] = bound;
  }
  if (absl::Status status = amend_size(element); !status.ok()) return status;
  if (absl::Status status = amend_servo(element); !status.ok()) return status;
  return amend_file(element, notices);
}

absl::Status Document::read(Notices& notices) {
  folder_ = file_.directory().string();
  Element& root = file_.root();
  if (absl::Status status = include(root, 0, notices); !status.ok()) return status;
  each(root, [&](Element& element) {
    if (xml::is(element, "default") && !xml::is(*element.Parent()->ToElement(), "default"))
      collect_classes(element, "");
    if (xml::is(element, "compiler")) {
      const std::string assets = xml::attribute_of(&element, "assetdir");
      if (!assets.empty()) assets_ = assets;
      if (const std::string own = xml::attribute_of(&element, "meshdir"); !own.empty()) meshes_ = own;
      if (!assets.empty() && meshes_.empty()) element.SetAttribute("meshdir", assets.c_str());
      strips_paths_ = strips_paths_ || element.BoolAttribute("strippath", false);
    }
    return absl::OkStatus();
  }).IgnoreError();
  absl::Status status = each(root, [&](Element& element) { return amend(element, notices); });
  if (!status.ok()) return status;
  return notices.missing_files();
}

void Document::write(Element& element, std::string& text) {
  const auto file = included_.find(&element);
  if (file != included_.end()) {
    for (Element* child = file->second->root().FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement())
      write(*child, text);
    return;
  }
  lines_.push_back(&element);
  absl::StrAppend(&text, "\n<", element.Name());
  // MuJoCo 2.2 counts numbers by single spaces.
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
       attribute = attribute->Next()) {
    const std::vector<absl::string_view> words =
        absl::StrSplit(attribute->Value(), absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty());
    const std::string value = absl::StrJoin(words, " ");
    absl::StrAppend(&text, " ", attribute->Name(), "=\"", escaped(value), "\"");
  }
  absl::StrAppend(&text, ">");
  // As of MuJoCo 2.3, a range is a limit unless the file says something else.
  if (&element == &file_.root()) absl::StrAppend(&text, "<compiler autolimits=\"true\"/>");
  for (Element* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement())
    write(*child, text);
  absl::StrAppend(&text, "</", element.Name(), ">");
}

std::string Document::text() {
  lines_.clear();
  std::string text;
  write(file_.root(), text);
  return text.substr(1);
}

const Element* Document::element_at(const std::string& error) const {
  const std::size_t place = error.find("line");
  if (place == std::string::npos) return nullptr;
  const std::size_t digit = error.find_first_of("0123456789", place);
  if (digit == std::string::npos) return nullptr;
  std::size_t line = 0;
  const std::size_t end = std::min(error.find_first_not_of("0123456789", digit), error.size());
  if (!absl::SimpleAtoi(error.substr(digit, end - digit), &line)) return nullptr;
  return line >= 1 && line <= lines_.size() ? lines_[line - 1] : nullptr;
}

bool Document::drop_unknown(const std::string& error, Notices& notices) {
  const Element* const at = element_at(error);
  if (at == nullptr) return false;
  if (const auto attribute = between(error, "unrecognized attribute: '", '\'')) {
    const std::string name = at->Name();
    bool is_dropped = false;
    for (Element* other : lines_) {
      if (!xml::is(*other, name) || other->Attribute(attribute->c_str()) == nullptr) continue;
      other->DeleteAttribute(attribute->c_str());
      is_dropped = true;
      if (std::ranges::find(kKnownHere, *attribute) == kKnownHere.end())
        notices.count(
            absl::StrCat("'", *attribute, "' of <", name, ">, which MuJoCo 2.2 does not know, skipped"));
    }
    return is_dropped;
  }
  const auto line = std::ranges::find(lines_, at);
  if (absl::StrContains(error, "unrecognized element") && at->Parent() != nullptr && line != lines_.begin()) {
    const std::string text = absl::StrCat("<", at->Name(), ">, which MuJoCo 2.2 does not know, skipped");
    if (is_one_of(*at, kBodiesOfNewerFiles)) {
      notices.count_loss(text);
    } else {
      notices.count(text);
    }
    (*line)->Parent()->DeleteChild(*line);
    return true;
  }
  const auto word = between(error, "invalid keyword: '", '\'');
  if (!word || !(xml::is(*at, "option") || xml::is(*at, "compiler"))) return false;
  for (const auto* attribute = at->FirstAttribute(); attribute != nullptr; attribute = attribute->Next()) {
    if (*word != attribute->Value()) continue;
    notices.count(absl::StrCat("'", attribute->Name(), "' of <", at->Name(),
                               ">, with a word that MuJoCo 2.2 ", "does not know, skipped"));
    (*line)->DeleteAttribute(attribute->Name());
    return true;
  }
  return false;
}

absl::Status Document::error(const std::string& error) const {
  std::string text = error.substr(0, error.find("\nObject name"));
  text = text.substr(0, text.find("Element '"));
  absl::RemoveExtraAsciiWhitespace(&text);
  const std::string message = absl::StrCat("MuJoCo: ", text);
  const Element* const at = element_at(error);
  if (at == nullptr) return absl::InvalidArgumentError(absl::StrCat(name(), ": ", message));
  return xml::invalid(*at, message);
}

}  // namespace tessera::mjcf
