#include "worlds/gazebo/system.h"

#include "worlds/gazebo/publication.h"

namespace tessera::gazebo {

std::string System::title() const {
  const char* const file = plugin_.Attribute("filename");
  return file == nullptr ? "<plugin>" : absl::StrCat("<plugin> ", file);
}

Eigen::Vector3d System::vector(const char* name, const Eigen::Vector3d& otherwise) {
  const xml::Element* const element = plugin_.FirstChildElement(name);
  if (element == nullptr) return otherwise;
  const absl::StatusOr<Eigen::Vector3d> given = xml::vector_in(*element, xml::text_of(*element));
  if (given.ok()) return *given;
  fail(given.status().message());
  return otherwise;
}

std::vector<std::string> System::texts(std::initializer_list<const char*> spellings) const {
  std::vector<std::string> texts;
  for (const char* name : spellings) {
    for (const xml::Element* child = plugin_.FirstChildElement(name); child != nullptr;
         child = child->NextSiblingElement(name)) {
      texts.push_back(xml::text_of(*child));
    }
  }
  return texts;
}

xml::Element* System::joint(const std::string& name) {
  xml::Element* const found = parts_.joint(name);
  if (found == nullptr) fail(absl::StrCat("there is no joint '", name, "' in its model"));
  return found;
}

std::optional<ModelParts::Place> System::place(const std::string& name) {
  std::optional<ModelParts::Place> found = parts_.place(name);
  if (!found) fail(absl::StrCat("there is no link or frame '", name, "' in its model"));
  return found;
}

xml::Element* System::side(const xml::Element& joint, const char* side) {
  xml::Element* const found = parts_.side(joint, side);
  if (found == nullptr) fail(absl::StrCat("the ", side, " of its joint is no link of its model"));
  return found;
}

xml::Element* System::chassis(const xml::Element& joint) {
  xml::Element* const found = parts_.side(joint, "parent");
  return found != nullptr ? found : first_link();
}

xml::Element* System::first_link() {
  xml::Element* const found = parts_.first_link();
  if (found == nullptr) fail("its model has no link");
  return found;
}

void System::write(const ProgramWriter& program, xml::Element& link) {
  const absl::Status status = program.write(link);
  if (!status.ok()) return fail(status.message());
  note_topics(plugin_, "*", *link.LastChildElement(kSystemProgram));
  programs_.push_back(program.kind());
}

void System::finish() {
  status_.Update(numbers_.status());
  if (!status_.ok()) {
    notices_.count_repair(absl::StrCat(title(), ", left out: ", status_.message()), xml::place_of(plugin_));
  } else if (!programs_.empty()) {
    const std::string kind = programs_.front();
    notices_.count(absl::StrCat(title(), " is the program ", kind), programs_.size());
  }
}

}  // namespace tessera::gazebo
