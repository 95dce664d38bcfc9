#include "worlds/gazebo/detachable.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <string>
#include <vector>

#include "worlds/gazebo/model_parts.h"
#include "worlds/gazebo/program_writer.h"
#include "worlds/gazebo/publication.h"
#include "worlds/gazebo/systems.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

constexpr char kSystem[] = "detachable-joint";

Element* model_named(Element& world, const std::string& name) {
  for (Element* model = world.FirstChildElement("model"); model != nullptr;
       model = model->NextSiblingElement("model")) {
    if (xml::attribute_of(model, "name") == name) return model;
  }
  return nullptr;
}

// The n-th of its model. INVALID_ARGUMENT for what it names and what is not there.
absl::Status take(const Element& plugin, Element& model, std::size_t n, Element& world) {
  const std::string own = xml::attribute_of(&model, "name");
  const std::string other = xml::child_text(plugin, "child_model");
  const bool is_inside = other == "__model__" || other == own;
  Element* const child_model = is_inside ? &model : model_named(world, other);
  if (child_model == nullptr)
    return absl::InvalidArgumentError(absl::StrCat("there is no <model> '", other, "' beside its own"));
  const std::string parent_name = xml::child_text(plugin, "parent_link");
  const std::string child_name = xml::child_text(plugin, "child_link");
  Element* const parent = ModelParts(model).link(parent_name);
  if (parent == nullptr)
    return absl::InvalidArgumentError(absl::StrCat("there is no link '", parent_name, "' in its model"));
  Element* const child = ModelParts(*child_model).link(child_name);
  if (child == nullptr)
    return absl::InvalidArgumentError(absl::StrCat("there is no link '", child_name, "' in its child model"));
  const std::string name = absl::StrCat(own, "_detachable_", n);
  ProgramWriter program("breaker", xml::attribute_of(&plugin, "name"));
  program.set("joint", name);
  // A link that does not move has no programs.
  Element& holder = ModelParts(model).is_static() ? *child : *parent;
  if (absl::Status status = program.write(holder); !status.ok()) return status;
  xml::Element& written = *holder.LastChildElement(kSystemProgram);
  note_topics(plugin, own, written);
  Element& joint = *world.InsertNewChildElement("joint");
  joint.SetAttribute("name", name.c_str());
  joint.SetAttribute("type", "fixed");
  joint.InsertNewChildElement("parent")->SetText(absl::StrCat(own, "::", parent_name).c_str());
  joint.InsertNewChildElement("child")->SetText(
      absl::StrCat(xml::attribute_of(child_model, "name"), "::", child_name).c_str());
  return absl::OkStatus();
}

}  // namespace

void take_detachable_joints(Element& world, Notices& notices) {
  for (Element* model = world.FirstChildElement("model"); model != nullptr;
       model = model->NextSiblingElement("model")) {
    std::vector<Element*> plugins;
    for (Element* plugin = model->FirstChildElement("plugin"); plugin != nullptr;
         plugin = plugin->NextSiblingElement("plugin")) {
      if (canonical_name(*plugin) == kSystem) plugins.push_back(plugin);
    }
    for (std::size_t n = 0; n < plugins.size(); ++n) {
      const absl::Status status = take(*plugins[n], *model, n, world);
      if (status.ok()) {
        notices.count("<plugin> detachable joint is the program breaker, and a fixed joint");
      } else {
        notices.count_repair(absl::StrCat("<plugin> detachable joint, left out: ", status.message()),
                             xml::place_of(*plugins[n]));
      }
      model->DeleteChild(plugins[n]);
    }
  }
}

}  // namespace tessera::gazebo
