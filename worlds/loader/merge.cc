#include "worlds/loader/merge.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

namespace tessera {
namespace {

using xml::Element;

constexpr absl::string_view kOwnFrame = "__model__";

// The link that a model's frame is fixed to; empty if it has none.
std::string canonical_link(const Element& model) {
  if (const char* given = model.Attribute("canonical_link"); given != nullptr && *given != '\0') return given;
  if (const Element* link = model.FirstChildElement("link")) {
    const char* name = link->Attribute("name");
    return name != nullptr ? name : "";
  }
  for (const Element* inner = model.FirstChildElement("model"); inner != nullptr;
       inner = inner->NextSiblingElement("model")) {
    const std::string link = canonical_link(*inner);
    const char* name = inner->Attribute("name");
    if (!link.empty() && name != nullptr) return absl::StrCat(name, "::", link);
  }
  return "";
}

class Proxy {
 public:
  explicit Proxy(const std::string& name) : name_(name) {}

  // In the place of the model's own frame; of none, too, where that is what none stands for.
  void set_attribute(Element* element, const char* attribute, bool stands_for_none) const {
    if (element == nullptr) return;
    const char* const value = element->Attribute(attribute);
    const bool is_none = value == nullptr || *value == '\0';
    if (is_none ? stands_for_none : value == kOwnFrame) element->SetAttribute(attribute, name_.c_str());
  }
  void set_text(Element* element) const {
    if (element != nullptr && xml::text_of(*element) == kOwnFrame) element->SetText(name_.c_str());
  }

 private:
  const std::string& name_;
};

// Of a copy, whose parent is another model now.
void take_over(Element& part, const Proxy& proxy) {
  Element* pose = part.FirstChildElement("pose");
  if (xml::is(part, "link") || xml::is(part, "model")) {
    if (pose == nullptr) pose = part.InsertNewChildElement("pose");
    proxy.set_attribute(pose, "relative_to", true);
  } else if (xml::is(part, "frame")) {
    proxy.set_attribute(&part, "attached_to", true);
    proxy.set_attribute(pose, "relative_to", false);
  } else if (xml::is(part, "joint")) {
    proxy.set_attribute(pose, "relative_to", false);
    proxy.set_text(part.FirstChildElement("parent"));
    proxy.set_text(part.FirstChildElement("child"));
    for (const char* axis : {"axis", "axis2"}) {
      if (Element* of = part.FirstChildElement(axis))
        proxy.set_attribute(of->FirstChildElement("xyz"), "expressed_in", false);
    }
  }
}

bool is_part(const Element& element) {
  for (const char* name : {"link", "model", "frame", "joint", "gripper"}) {
    if (xml::is(element, name)) return true;
  }
  return absl::StrContains(element.Name(), ':');
}

}  // namespace

absl::StatusOr<Element*> merge_model(const Element& source, const std::string& proxy, Element& model) {
  const std::string link = canonical_link(source);
  if (link.empty()) return xml::invalid(source, "a model without links cannot be merged");
  Element& frame = *model.InsertNewChildElement("frame");
  frame.SetAttribute("name", proxy.c_str());
  frame.SetAttribute("attached_to", link.c_str());
  for (const Element* child = source.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (!is_part(*child)) continue;
    tinyxml2::XMLNode* const copy = child->DeepClone(model.GetDocument());
    model.InsertEndChild(copy);
    take_over(*copy->ToElement(), Proxy(proxy));
  }
  return &frame;
}

}  // namespace tessera
