// Numbers of elements, of which the first that is none is remembered.
#pragma once

#include <absl/status/status.h>

#include <initializer_list>
#include <string>

#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// The element at the end of a way of children; null where one of them is missing, or `from` is.
const xml::Element* find(const xml::Element* from, std::initializer_list<const char*> way);

class Numbers {
 public:
  // The number in an element; `otherwise` where there is no such element.
  double read(const xml::Element* element, double otherwise);
  double read(const xml::Element& parent, const char* child, double otherwise) {
    return read(parent.FirstChildElement(child), otherwise);
  }
  // That of the first of these children that there is: files have several spellings.
  double read(const xml::Element& parent, std::initializer_list<const char*> spellings, double otherwise);
  bool read_bool(const xml::Element& parent, const char* child, bool otherwise);

  // INVALID_ARGUMENT for the first text that was not a number.
  const absl::Status& status() const { return status_; }

 private:
  absl::Status status_;
};

// The text of the first of these children that there is.
std::string text_of_any(const xml::Element& parent, std::initializer_list<const char*> spellings);

}  // namespace tessera::gazebo
