#include "worlds/loader/left_out.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <string>

namespace tessera {
namespace {

using xml::Element;

// The parts of a model, by name: "link", "inner::link".
class PartNames {
 public:
  explicit PartNames(const Element& model) { collect(model, ""); }

  bool has_link() const { return has_link_; }
  // Also for names that every model knows.
  bool knows(const std::string& name) const {
    return name.empty() || name == "world" || absl::EndsWith(name, "__model__") || names_.contains(name);
  }

 private:
  void collect(const Element& model, const std::string& prefix) {
    for (const Element* part = model.FirstChildElement(); part != nullptr;
         part = part->NextSiblingElement()) {
      const char* const name = part->Attribute("name");
      if (name == nullptr) continue;
      names_.insert(absl::StrCat(prefix, name));
      has_link_ = has_link_ || xml::is(*part, "link");
      if (xml::is(*part, "model")) collect(*part, absl::StrCat(prefix, name, "::"));
    }
  }

  absl::flat_hash_set<std::string> names_;
  bool has_link_ = false;
};

bool dangles(const Element& part, const PartNames& parts) {
  if (!parts.knows(xml::attribute_of(part.FirstChildElement("pose"), "relative_to"))) return true;
  if (xml::is(part, "frame")) return !parts.knows(xml::attribute_of(&part, "attached_to"));
  return xml::is(part, "joint") &&
         !(parts.knows(xml::child_text(part, "parent")) && parts.knows(xml::child_text(part, "child")));
}

// One pass; whether something was removed, which may leave more that dangles.
bool remove_once(Element& model, Notices& notices) {
  const PartNames parts(model);
  bool removed = false;
  for (Element* part = model.FirstChildElement(); part != nullptr;) {
    Element& element = *part;
    part = part->NextSiblingElement();
    if (xml::is(element, "model")) {
      if (remove_dangling(element, notices)) continue;
    } else if (!(xml::is(element, "joint") || xml::is(element, "frame")) || !dangles(element, parts)) {
      continue;
    }
    notices.count_loss(absl::StrCat("<", element.Name(), "> with a model that was left out, skipped"));
    model.DeleteChild(&element);
    removed = true;
  }
  return removed;
}

}  // namespace

bool remove_dangling(Element& model, Notices& notices) {
  while (remove_once(model, notices)) {
  }
  const PartNames parts(model);
  if (!parts.knows(xml::attribute_of(&model, "canonical_link"))) model.DeleteAttribute("canonical_link");
  return parts.has_link();
}

}  // namespace tessera
