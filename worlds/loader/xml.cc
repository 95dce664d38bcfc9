#include "worlds/loader/xml.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"
#include "lpss/model/limits.h"

namespace tessera::xml {
namespace {

constexpr std::size_t kQuotedBytesMax = 64;  // of a file's text, in messages

// Refuses document types anywhere, and excessive depth.
class Guard : public tinyxml2::XMLVisitor {
 public:
  bool VisitEnter(const Element& element, const tinyxml2::XMLAttribute*) override {
    ++depth_;
    if (depth_ > kXmlDepthMax && status_.ok()) {
      status_ = invalid(element, "elements are nested deeper than ", kXmlDepthMax);
    }
    return status_.ok();
  }
  bool VisitExit(const Element&) override {
    --depth_;
    return status_.ok();
  }
  bool Visit(const tinyxml2::XMLUnknown& unknown) override {
    status_ = absl::InvalidArgumentError(
        absl::StrCat("line ", unknown.GetLineNum(), ": <!", std::string(unknown.Value()).substr(0, 20),
                     "...>: document types and their entities are not allowed"));
    return false;
  }

  const absl::Status& status() const { return status_; }

 private:
  int depth_ = 0;
  absl::Status status_;
};

std::string mebibytes(std::uintmax_t bytes) { return absl::StrCat(bytes >> 20, " MiB"); }

absl::Status too_large(const std::string& name, std::uintmax_t bytes) {
  return absl::InvalidArgumentError(absl::StrCat(name, ": ", mebibytes(bytes), " (", bytes,
                                                 " bytes) must be at most ", mebibytes(kWorldFileBytesMax)));
}

// The tag of the element in tinyxml2's message; "<...>" if it names none.
std::string tag_in(absl::string_view said) {
  constexpr absl::string_view kBefore = "XMLElement name=";
  const std::size_t place = said.rfind(kBefore);
  if (place == absl::string_view::npos) return "<...>";
  const absl::string_view name = said.substr(place + kBefore.size());
  return absl::StrCat("<", name.substr(0, kQuotedBytesMax), name.size() > kQuotedBytesMax ? "...>" : ">");
}

// Whether a line (from 1) of a text has a < that no name, "/", "!" or "?" follows.
bool begins_no_tag(absl::string_view text, int line) {
  for (; line > 1 && absl::StrContains(text, '\n'); --line) text.remove_prefix(text.find('\n') + 1);
  text = text.substr(0, text.find('\n'));
  for (std::size_t place = text.find('<'); place != text.npos; place = text.find('<', place + 1)) {
    const char next = place + 1 < text.size() ? text[place + 1] : ' ';
    const bool begins_name = absl::ascii_isalpha(static_cast<unsigned char>(next)) ||
                             !absl::ascii_isascii(static_cast<unsigned char>(next));
    if (!begins_name && !absl::StrContains("_:/!?", next)) return true;
  }
  return false;
}

std::string what_is_wrong(const tinyxml2::XMLDocument& document, absl::string_view text) {
  switch (document.ErrorID()) {
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
      return absl::StrContains(text, '\0') ? "a byte is 0, so this is no text" : "the text is empty";
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT:
      return absl::StrCat(tag_in(document.ErrorStr()),
                          " is not closed, or another tag is closed in its place");
    case tinyxml2::XML_ERROR_PARSING_ELEMENT:
      return absl::StrCat("the tag ", tag_in(document.ErrorStr()), " has no end, or an invalid character");
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE:
      return absl::StrCat("each attribute of ", tag_in(document.ErrorStr()),
                          " must occur once, as name=\"value\"");
    case tinyxml2::XML_ERROR_PARSING_TEXT:
      return "there is text outside of all elements, or in one that is not closed";
    case tinyxml2::XML_ERROR_PARSING_CDATA:
      return "a <![CDATA[ has no ]]>";
    case tinyxml2::XML_ERROR_PARSING_COMMENT:
      return "a comment has no -->";
    case tinyxml2::XML_ERROR_PARSING_DECLARATION:
      return "a <?...?> has no end, or comes after an element";
    case tinyxml2::XML_ERROR_PARSING_UNKNOWN:
      return "a <!...> has no end";
    default:
      return begins_no_tag(text, document.ErrorLineNum())
                 ? "a < begins no tag"
                 : "the text ends before an element that begins here is closed";
  }
}

// "a.sdf:12", without the line where there is none.
std::string place_in(const std::string& name, int line) {
  return line > 0 ? absl::StrCat(name, ":", line) : name;
}

// x y z roll pitch yaw: turned about the fixed x, then y, then z axis.
Eigen::Quaterniond from_euler(double roll, double pitch, double yaw) {
  if (roll == 0 && pitch == 0 && yaw == 0) return Eigen::Quaterniond::Identity();
  return (rotation_by({0, 0, yaw}) * rotation_by({0, pitch, 0}) * rotation_by({roll, 0, 0})).normalized();
}

absl::StatusOr<Eigen::Quaterniond> rotation_in(const Element& pose, const std::vector<double>& numbers) {
  const char* format = pose.Attribute("rotation_format");
  if (format == nullptr || absl::string_view(format) == "euler_rpy") {
    if (numbers.size() != 6) return invalid(pose, numbers.size(), " numbers must be 6: x y z roll pitch yaw");
    const double unit = pose.BoolAttribute("degrees", false) ? std::numbers::pi / 180 : 1;
    return from_euler(numbers[3] * unit, numbers[4] * unit, numbers[5] * unit);
  }
  if (absl::string_view(format) != "quat_xyzw") {
    return invalid(pose, "rotation_format '", format, "' must be euler_rpy or quat_xyzw");
  }
  if (numbers.size() != 7) return invalid(pose, numbers.size(), " numbers must be 7: x y z qx qy qz qw");
  const Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
  const double norm = q.coeffs().norm();
  if (std::abs(norm - 1) > kQuaternionNormTolerance) {
    return invalid(pose, "the quaternion's norm ", norm, " must be 1 within ", kQuaternionNormTolerance);
  }
  return q.normalized();
}

}  // namespace

File::File(std::string name, std::filesystem::path directory)
    : name_(std::move(name)), directory_(std::move(directory)) {
  document_.SetUserData(this);
}

absl::StatusOr<std::unique_ptr<File>> File::read(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": it is a folder, not a world file"));
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": there is no such file"));
  }
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (!error && bytes > kWorldFileBytesMax) return too_large(path.string(), bytes);
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.good() && !stream.eof()) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": the file cannot be read"));
  }
  return parse(text, path.string(), path.parent_path());
}

absl::StatusOr<std::unique_ptr<File>> File::parse(absl::string_view text, const std::string& name,
                                                  const std::filesystem::path& directory) {
  if (text.size() > kWorldFileBytesMax) return too_large(name, text.size());
  std::unique_ptr<File> file(new File(name, directory));
  const tinyxml2::XMLError error = file->document_.Parse(text.data(), text.size());
  if (error == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    return absl::InvalidArgumentError(absl::StrCat(name, ":", file->document_.ErrorLineNum(),
                                                   ": elements are nested deeper than ", kXmlDepthMax));
  }
  if (error != tinyxml2::XML_SUCCESS) {
    return absl::InvalidArgumentError(
        absl::StrCat(place_in(name, file->document_.ErrorLineNum()),
                     ": malformed XML: ", what_is_wrong(file->document_, text)));
  }
  if (file->document_.RootElement() == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": the XML has no element"));
  }
  Guard guard;
  file->document_.Accept(&guard);
  if (!guard.status().ok()) {
    const bool named = absl::StartsWith(guard.status().message(), name);
    return named ? guard.status()
                 : absl::InvalidArgumentError(absl::StrCat(name, ": ", guard.status().message()));
  }
  return file;
}

std::string title(const Element& element) {
  const char* name = element.Attribute("name");
  return name == nullptr ? absl::StrCat("<", element.Name(), ">")
                         : absl::StrCat("<", element.Name(), " name='", name, "'>");
}

std::string place_of(const Element& element) {
  const auto* file = static_cast<const File*>(element.GetDocument()->GetUserData());
  std::string what = title(element);
  // Most elements have no name of their own; the nearest ancestor with one identifies it.
  if (element.Attribute("name") == nullptr) {
    for (const auto* up = element.Parent(); up != nullptr; up = up->Parent()) {
      const Element* parent = up->ToElement();
      if (parent == nullptr || parent->Attribute("name") == nullptr) continue;
      what = absl::StrCat(what, " of ", title(*parent));
      break;
    }
  }
  return absl::StrCat(file == nullptr ? "" : file->name(), ":", element.GetLineNum(), ": ", what);
}

absl::Status error_at(const Element& element, absl::StatusCode code, absl::string_view message) {
  return absl::Status(code, absl::StrCat(place_of(element), ": ", message));
}

absl::Status only_attributes(const Element& element, std::initializer_list<absl::string_view> known) {
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
       attribute = attribute->Next()) {
    bool found = false;
    for (absl::string_view name : known) found = found || name == attribute->Name();
    if (!found) return invalid(element, "unknown attribute '", attribute->Name(), "'");
  }
  return absl::OkStatus();
}

bool is(const Element& element, absl::string_view name) { return name == element.Name(); }

std::string text_of(const Element& element) {
  const char* text = element.GetText();
  return text == nullptr ? "" : std::string(absl::StripAsciiWhitespace(text));
}

std::string child_text(const Element& element, const char* name) {
  const Element* child = element.FirstChildElement(name);
  return child == nullptr ? "" : text_of(*child);
}

std::string attribute_of(const Element* element, const char* name) {
  const char* const value = element == nullptr ? nullptr : element->Attribute(name);
  return value == nullptr ? "" : value;
}

Element& copy_into(const Element& element, Element& parent) {
  tinyxml2::XMLNode* const copy = element.DeepClone(parent.GetDocument());
  parent.InsertEndChild(copy);
  return *copy->ToElement();
}

absl::StatusOr<std::string> required_attribute(const Element& element, const char* name) {
  const char* value = element.Attribute(name);
  if (value == nullptr || *value == '\0') return invalid(element, "the attribute '", name, "' is missing");
  return std::string(value);
}

namespace {

std::string named(absl::string_view attribute) {
  return attribute.empty() ? "" : absl::StrCat("the attribute ", attribute, ": ");
}

}  // namespace

absl::StatusOr<std::vector<double>> numbers_in(const Element& element, absl::string_view text,
                                               absl::string_view attribute) {
  std::vector<double> numbers;
  for (absl::string_view word : absl::StrSplit(text, absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty())) {
    double number = 0;
    if (!absl::SimpleAtod(word, &number))
      return invalid(element, named(attribute), "'", word, "' is not a number");
    if (!std::isfinite(number)) return invalid(element, named(attribute), "'", word, "' must be finite");
    numbers.push_back(number);
  }
  return numbers;
}

absl::StatusOr<Eigen::Vector3d> vector_in(const Element& element, absl::string_view text,
                                          absl::string_view attribute) {
  const absl::StatusOr<std::vector<double>> numbers = numbers_in(element, text, attribute);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != 3) return invalid(element, named(attribute), "'", text, "' must be 3 numbers");
  return Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

absl::StatusOr<double> number_of(const Element& element) {
  const std::string text = text_of(element);
  const absl::StatusOr<std::vector<double>> numbers = numbers_in(element, text);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != 1) return invalid(element, "'", text, "' must be one number");
  return numbers->front();
}

absl::StatusOr<double> number_attribute(const Element& element, const char* name) {
  const absl::StatusOr<std::string> text = required_attribute(element, name);
  if (!text.ok()) return text.status();
  const absl::StatusOr<std::vector<double>> numbers = numbers_in(element, *text, name);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() != 1)
    return invalid(element, "the attribute ", name, " = '", *text, "' must be one number");
  return numbers->front();
}

void set_number(Element& element, double value) { element.SetText(absl::StrFormat("%.17g", value).c_str()); }

absl::StatusOr<bool> bool_of(const Element& element) {
  const std::string text = absl::AsciiStrToLower(text_of(element));
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return invalid(element, "'", text, "' must be true or false");
}

absl::StatusOr<std::int64_t> integer_in(const Element& element, absl::string_view text) {
  std::int64_t value = 0;
  if (absl::SimpleAtoi(text, &value)) return value;
  return invalid(element, "'", text, "' must be an integer from -2^63 to 2^63 - 1");
}

absl::StatusOr<RelativePose> pose_of(const Element& pose) {
  RelativePose result;
  for (const char* attribute : {"relative_to", "frame"}) {
    if (const char* frame = pose.Attribute(attribute); frame != nullptr && *frame != '\0') {
      result.relative_to = frame;
      break;
    }
  }
  absl::StatusOr<std::vector<double>> numbers = numbers_in(pose, text_of(pose));
  if (!numbers.ok()) return numbers.status();
  if (numbers->empty()) return result;
  absl::StatusOr<Eigen::Quaterniond> rotation = rotation_in(pose, *numbers);
  if (!rotation.ok()) return rotation.status();
  result.pose = {{(*numbers)[0], (*numbers)[1], (*numbers)[2]}, *rotation};
  return result;
}

Eigen::Vector3d angles_of(const Eigen::Quaterniond& rotation) {
  constexpr double kUpright = 1e-12;  // below, roll and yaw turn about one axis, and all is yaw
  const Eigen::Matrix3d r = rotation.toRotationMatrix();
  const double level = std::sqrt(r(0, 0) * r(0, 0) + r(1, 0) * r(1, 0));
  const double pitch = portable::atan2(-r(2, 0), level);
  if (level < kUpright) return {0, pitch, portable::atan2(-r(0, 1), r(1, 1))};
  return {portable::atan2(r(2, 1), r(2, 2)), pitch, portable::atan2(r(1, 0), r(0, 0))};
}

void set_pose(Element& element, const Pose& pose) {
  const Eigen::Vector3d& p = pose.position;
  const Eigen::Quaterniond& q = pose.orientation;
  element.SetText(absl::StrFormat("%.17g %.17g %.17g %.17g %.17g %.17g %.17g", p.x(), p.y(), p.z(), q.x(),
                                  q.y(), q.z(), q.w())
                      .c_str());
  element.SetAttribute("rotation_format", "quat_xyzw");
  element.DeleteAttribute("degrees");
  element.DeleteAttribute("relative_to");
}

void write_as_quaternion(Element& pose) {
  const absl::StatusOr<RelativePose> parsed = pose_of(pose);
  if (!parsed.ok() || text_of(pose).empty()) return;
  set_pose(pose, parsed->pose);
  if (!parsed->relative_to.empty()) pose.SetAttribute("relative_to", parsed->relative_to.c_str());
}

std::string print(const Element& element) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  element.Accept(&printer);
  return printer.CStr();
}

}  // namespace tessera::xml
