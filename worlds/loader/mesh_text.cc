#include "worlds/loader/mesh_text.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace tessera {
namespace {

using xml::Element;

constexpr std::array<absl::string_view, 3> kMaterials = {"library_effects", "library_materials",
                                                         "library_images"};

bool is_blank(char c) { return c == ' ' || c == '\t'; }

// Without blanks before the text of an element, or of any below. Whether there were some.
bool strip_blanks(Element& element) {
  bool changed = false;
  for (tinyxml2::XMLNode* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
    if (Element* const below = child->ToElement()) changed = strip_blanks(*below) || changed;
    tinyxml2::XMLText* const text = child->ToText();
    if (text == nullptr || !absl::ascii_isspace(static_cast<unsigned char>(*text->Value()))) continue;
    const std::string stripped(absl::StripLeadingAsciiWhitespace(text->Value()));
    text->SetValue(stripped.c_str());
    changed = true;
  }
  return changed;
}

}  // namespace

std::optional<std::string> amended_obj(absl::string_view text) {
  std::string result;
  std::size_t copied = 0;
  bool in_vertex = false;
  bool begins_line = true;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (c == '\n' || c == '\r') {
      // A line goes on behind a backslash.
      if (n == 0 || text[n - 1] != '\\') begins_line = true;
      continue;
    }
    if (begins_line && !is_blank(c)) {
      in_vertex = c == 'v';
      begins_line = false;
    }
    if (!in_vertex || c != '.' || n + 1 == text.size() || n == 0) continue;
    const bool is_signed = text[n - 1] == '-' || text[n - 1] == '+';
    const std::size_t before = n - (is_signed ? 1 : 0);
    const bool begins_number =
        before > 0 && absl::ascii_isspace(static_cast<unsigned char>(text[before - 1]));
    if (!begins_number || !absl::ascii_isdigit(static_cast<unsigned char>(text[n + 1]))) continue;
    absl::StrAppend(&result, text.substr(copied, n - copied), "0");
    copied = n;
  }
  if (copied == 0) return std::nullopt;
  absl::StrAppend(&result, text.substr(copied));
  return result;
}

std::optional<std::string> amended_collada(Element& collada) {
  bool changed = false;
  for (Element* library = collada.FirstChildElement(); library != nullptr;) {
    Element& element = *library;
    library = library->NextSiblingElement();
    if (std::ranges::find(kMaterials, absl::string_view(element.Name())) == kMaterials.end()) continue;
    collada.DeleteChild(&element);
    changed = true;
  }
  changed = strip_blanks(collada) || changed;
  if (!changed) return std::nullopt;
  return xml::print(collada);
}

}  // namespace tessera
