// The links, joints and frames of a <model>, as sensors and systems name them.
#pragma once

#include <optional>
#include <string>

#include "lpss/base/pose.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// Names are those in the model, "inner::arm" for what is in a <model> in it, with or without the name of the
// model itself in front. Models that an <include> stands for are not looked into.
class ModelParts {
 public:
  explicit ModelParts(xml::Element& model) : model_(model) {}

  xml::Element& model() const { return model_; }
  // Null where there is none.
  xml::Element* link(const std::string& name) const { return find("link", name); }
  xml::Element* joint(const std::string& name) const;
  xml::Element* first_link() const { return model_.FirstChildElement("link"); }
  // kg, of its links, as far as they say; but for one.
  double mass(const xml::Element* but = nullptr) const;

  struct Place {
    xml::Element* link = nullptr;
    Pose pose;  // in the link
  };
  // A link, or a frame that is attached to one, directly or through others; nothing where there is none, or
  // where its pose is relative to something else.
  std::optional<Place> place(const std::string& name) const;

  // Whether the model is static.
  bool is_static() const;
  // A static model becomes one that stands because nobody leads it, so that it may have programs.
  void make_kinematic() const;

  // The name of a joint or link in the model: "inner::arm".
  std::string name_of(const xml::Element& part) const;

  // The link that a side of a joint names, "parent" or "child": null where it is the world, or not here.
  xml::Element* side(const xml::Element& joint, const char* side) const;

 private:
  xml::Element* find(const char* tag, const std::string& name) const;

  xml::Element& model_;
};

}  // namespace tessera::gazebo
