#include "worlds/gazebo/numbers.h"

namespace tessera::gazebo {

using xml::Element;

const Element* find(const Element* from, std::initializer_list<const char*> way) {
  for (const char* name : way) {
    if (from == nullptr) return nullptr;
    from = from->FirstChildElement(name);
  }
  return from;
}

double Numbers::read(const Element* element, double otherwise) {
  if (element == nullptr) return otherwise;
  const absl::StatusOr<double> number = xml::number_of(*element);
  if (number.ok()) return *number;
  status_.Update(number.status());
  return otherwise;
}

double Numbers::read(const Element& parent, std::initializer_list<const char*> spellings, double otherwise) {
  for (const char* name : spellings) {
    if (const Element* const child = parent.FirstChildElement(name)) return read(child, otherwise);
  }
  return otherwise;
}

bool Numbers::read_bool(const Element& parent, const char* child, bool otherwise) {
  const Element* const element = parent.FirstChildElement(child);
  if (element == nullptr) return otherwise;
  const absl::StatusOr<bool> value = xml::bool_of(*element);
  if (value.ok()) return *value;
  status_.Update(value.status());
  return otherwise;
}

std::string text_of_any(const Element& parent, std::initializer_list<const char*> spellings) {
  for (const char* name : spellings) {
    if (const Element* const child = parent.FirstChildElement(name)) return xml::text_of(*child);
  }
  return "";
}

}  // namespace tessera::gazebo
