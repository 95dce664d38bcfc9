// XML files with bounds on size and depth, and errors that name file, line and element.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "lpss/grid/world_position.h"

namespace tessera::xml {

using Element = tinyxml2::XMLElement;

// A parsed document that knows its origin.
class File {
 public:
  // NOT_FOUND, or INVALID_ARGUMENT as for parse().
  static absl::StatusOr<std::unique_ptr<File>> read(const std::filesystem::path& path);

  // `name` identifies the text in messages. INVALID_ARGUMENT for malformed XML, text above
  // kWorldFileBytesMax, elements nested deeper than kXmlDepthMax, and document types, which could
  // define entities that expand to gigabytes.
  static absl::StatusOr<std::unique_ptr<File>> parse(absl::string_view text, const std::string& name,
                                                     const std::filesystem::path& directory);

  File(const File&) = delete;
  File& operator=(const File&) = delete;

  Element& root() { return *document_.RootElement(); }
  const std::string& name() const { return name_; }
  const std::filesystem::path& directory() const { return directory_; }  // for relative paths in it

 private:
  File(std::string name, std::filesystem::path directory);

  std::string name_;
  std::filesystem::path directory_;
  tinyxml2::XMLDocument document_;
};

// "<model name='box'>".
std::string title(const Element& element);

// "a.sdf:12: <mass> of <link name='arm'>", with the nearest ancestor that has a name.
std::string place_of(const Element& element);

// An error that begins with file, line and element: "a.sdf:12: <model name='box'>: ...".
absl::Status error_at(const Element& element, absl::StatusCode code, absl::string_view message);

template <typename... Args>
absl::Status invalid(const Element& element, const Args&... args) {
  return error_at(element, absl::StatusCode::kInvalidArgument, absl::StrCat(args...));
}

// INVALID_ARGUMENT for an element with an attribute of another name.
absl::Status only_attributes(const Element& element, std::initializer_list<absl::string_view> known);

bool is(const Element& element, absl::string_view name);

// The element's text without surrounding white space; empty if it has none.
std::string text_of(const Element& element);

// The text of the first child of that name; empty if there is none.
std::string child_text(const Element& element, const char* name);

// The attribute; empty if there is none, or no element.
std::string attribute_of(const Element* element, const char* name);

// A copy of an element, of another document too, as the last child of `parent`.
Element& copy_into(const Element& element, Element& parent);

// INVALID_ARGUMENT if the attribute is missing or empty.
absl::StatusOr<std::string> required_attribute(const Element& element, const char* name);

// Attributes and elements as finite numbers; errors name the place.
absl::StatusOr<double> number_attribute(const Element& element, const char* name);
absl::StatusOr<double> number_of(const Element& element);
void set_number(Element& element, double value);
absl::StatusOr<bool> bool_of(const Element& element);
absl::StatusOr<std::int64_t> integer_in(const Element& element, absl::string_view text);
// Errors name the attribute that the text is of, unless it is that of the element itself.
absl::StatusOr<std::vector<double>> numbers_in(const Element& element, absl::string_view text,
                                               absl::string_view attribute = "");
absl::StatusOr<Eigen::Vector3d> vector_in(const Element& element, absl::string_view text,
                                          absl::string_view attribute = "");

// A <pose> element: its pose, and the frame that it is relative to (empty: the enclosing one).
struct RelativePose {
  Pose pose;
  std::string relative_to;
};
absl::StatusOr<RelativePose> pose_of(const Element& pose);

// Rewrites a valid <pose> with its rotation as a quaternion. libsdformat would turn angles into one by the C
// library's functions, whose last bits depend on the processor.
void write_as_quaternion(Element& pose);

// Roll, pitch and yaw (rad): about the fixed x, then y, then z axis.
Eigen::Vector3d angles_of(const Eigen::Quaterniond& rotation);

// Rewrites a <pose> as this one, relative to the enclosing frame.
void set_pose(Element& element, const Pose& pose);

// The element with all its contents, on one line.
std::string print(const Element& element);

}  // namespace tessera::xml
