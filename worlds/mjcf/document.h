// An MJCF file with all that it includes, as the one text that MuJoCo gets.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::mjcf {

// Grids of elements that one <composite> stands for. MuJoCo names them all, and looks for each name.
inline constexpr double kCompositeElementsMax = 10'000;

class Document {
 public:
  // `file` outlives it, and is changed.
  explicit Document(xml::File& file) : file_(file) {}

  // Reads includes, and takes out what only the eye sees. Newer words become those of MuJoCo 2.2, where it
  // has words for them. NOT_FOUND with all files that are not there; INVALID_ARGUMENT, with file, line and
  // element, for what is too large.
  absl::Status read(Notices& notices);

  // One element a line.
  std::string text();

  // Takes out what MuJoCo has called unknown in the last text: an attribute, of all elements of that name; an
  // element; a word of an <option>. False if `error` is about something else.
  bool drop_unknown(const std::string& error, Notices& notices);

  // An error of MuJoCo about the last text, at its place in the files.
  absl::Status error(const std::string& error) const;

  // What newer files say of the efforts of all actuators of a joint: the bound, by the names of joints.
  const std::map<std::string, double>& efforts() const { return efforts_; }
  // Whether the file says how long a step is.
  bool has_time_step() const { return has_time_step_; }
  const std::string& folder() const { return folder_; }
  const std::string& name() const { return file_.name(); }
  // That of the root; may be empty.
  std::string model() { return xml::attribute_of(&file_.root(), "model"); }

 private:
  struct Class {
    std::string parent;  // empty: none
    std::vector<const xml::Element*> elements;
  };

  template <typename Visit>
  absl::Status each(xml::Element& parent, const Visit& visit);
  absl::Status include(xml::Element& parent, int depth, Notices& notices);
  absl::Status splice(const xml::Element& element, int depth, Notices& notices);
  void collect_classes(xml::Element& defaults, const std::string& parent);
  std::optional<std::string> inherited(const xml::Element& element, const char* attribute) const;
  absl::Status amend(xml::Element& element, Notices& notices);
  absl::Status amend_size(const xml::Element& element) const;
  absl::Status amend_file(const xml::Element& element, Notices& notices) const;
  absl::Status amend_servo(xml::Element& element) const;
  void write(xml::Element& element, std::string& text);
  const xml::Element* element_at(const std::string& error) const;

  xml::File& file_;
  std::string folder_;
  absl::flat_hash_map<const xml::Element*, std::unique_ptr<xml::File>> included_;  // by <include>
  std::map<std::string, Class> classes_;
  std::map<std::string, double> efforts_;
  std::filesystem::path meshes_;
  std::filesystem::path assets_;
  bool strips_paths_ = false;
  bool has_time_step_ = false;
  std::vector<xml::Element*> lines_;  // of the last text
};

}  // namespace tessera::mjcf
