#include "worlds/loader/visuals.h"

#include <absl/status/statusor.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "worlds/loader/file_search.h"

namespace tessera {
namespace {

using xml::Element;

constexpr absl::string_view kMark = "tessera_visual_";
constexpr absl::string_view kNoColour = "______";  // as long as one

// Those of Gazebo's materials that are a colour alone.
constexpr auto kGazeboColours = std::to_array<std::pair<absl::string_view, std::uint32_t>>({
    {"Black", 0x1a1a1a},     {"Blue", 0x0000ff},      {"DarkGray", 0x2d2d2d},   {"DarkGrey", 0x2d2d2d},
    {"FlatBlack", 0x1a1a1a}, {"Gold", 0xccaa1a},      {"Gray", 0xb3b3b3},       {"Green", 0x00ff00},
    {"Grey", 0xb3b3b3},      {"Indigo", 0x5400ad},    {"Orange", 0xff8200},     {"Purple", 0xff00ff},
    {"Red", 0xff0000},       {"Turquoise", 0x00ffff}, {"White", 0xffffff},      {"WhiteGlow", 0xffffff},
    {"Wood", 0x8f6b45},      {"Yellow", 0xffff00},    {"ZincYellow", 0xf5e02e},
});

std::optional<std::uint32_t> rgb_of(const std::vector<double>& numbers) {
  if (numbers.size() < 3) return std::nullopt;
  std::uint32_t colour = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    if (!std::isfinite(numbers[n])) return std::nullopt;
    colour = colour << 8 | static_cast<std::uint32_t>(std::lround(255 * std::clamp(numbers[n], 0.0, 1.0)));
  }
  return colour;
}

std::optional<std::uint32_t> rgb_of(const Element& element, const char* text) {
  const absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(element, text == nullptr ? "" : text);
  return numbers.ok() ? rgb_of(*numbers) : std::nullopt;
}

// URDF's <color> of a material, which may be defined elsewhere in the robot, under the same name.
std::optional<std::uint32_t> colour_in_urdf(const Element& material) {
  if (const Element* const colour = material.FirstChildElement("color"))
    return rgb_of(*colour, colour->Attribute("rgba"));
  const char* const name = material.Attribute("name");
  const Element* const robot = material.GetDocument()->RootElement();
  if (name == nullptr || !xml::is(*robot, "robot")) return std::nullopt;
  const auto named = [&](const Element& parent) -> std::optional<std::uint32_t> {
    for (const Element* other = parent.FirstChildElement("material"); other != nullptr;
         other = other->NextSiblingElement("material")) {
      const Element* const colour = other->FirstChildElement("color");
      if (colour != nullptr && other->Attribute("name", name) != nullptr)
        return rgb_of(*colour, colour->Attribute("rgba"));
    }
    return std::nullopt;
  };
  if (const auto colour = named(*robot)) return colour;
  for (const Element* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    for (const Element* visual = link->FirstChildElement("visual"); visual != nullptr;
         visual = visual->NextSiblingElement("visual")) {
      if (const auto colour = named(*visual)) return colour;
    }
  }
  return std::nullopt;
}

// SDF's <diffuse>, or a material of Gazebo by its name.
std::optional<std::uint32_t> colour_of(const Element& material) {
  for (const char* kind : {"diffuse", "ambient"}) {
    if (const Element* const colour = material.FirstChildElement(kind))
      return rgb_of(*colour, colour->GetText());
  }
  if (const Element* const script = material.FirstChildElement("script")) {
    std::string name = xml::child_text(*script, "name");
    if (name.empty()) name = xml::text_of(*script);
    const auto* const found = std::ranges::find(kGazeboColours, absl::StripPrefix(name, "Gazebo/"),
                                                &decltype(kGazeboColours)::value_type::first);
    if (found != kGazeboColours.end()) return found->second;
  }
  return colour_in_urdf(material);
}

bool is_transparent(const Element& visual) {
  double share = 0;
  return absl::SimpleAtod(xml::child_text(visual, "transparency"), &share) && share >= 1;
}

// Of a mesh of SDF or URDF.
bool lacks_its_file(const Element& visual, const std::filesystem::path& directory) {
  const Element* const geometry = visual.FirstChildElement("geometry");
  const Element* const mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
  if (mesh == nullptr) return false;
  const char* const name = mesh->Attribute("filename");
  const std::string uri = name == nullptr ? xml::child_text(*mesh, "uri") : name;
  return !find_uri(uri, directory).ok();
}

}  // namespace

void show_visuals(Element& link, const std::filesystem::path& directory, Notices& notices) {
  bool lacks_some = false;
  for (Element* visual = link.FirstChildElement("visual"); visual != nullptr;
       visual = visual->NextSiblingElement("visual"))
    lacks_some = lacks_some || lacks_its_file(*visual, directory);
  int count = 0;
  const auto show = [&](Element& element, std::optional<std::uint32_t> colour) {
    const std::string text =
        colour ? absl::StrCat(absl::Hex(*colour, absl::kZeroPad6)) : std::string(kNoColour);
    element.SetAttribute("name", absl::StrCat(kMark, text, "_", ++count).c_str());
  };
  for (Element* collision = link.FirstChildElement("collision"); collision != nullptr;) {
    Element* const one = collision;
    collision = collision->NextSiblingElement("collision");
    const char* const name = one->Attribute("name");
    if (name != nullptr && was_visual(name)) continue;
    if (lacks_some) {
      show(*one, std::nullopt);
    } else {
      link.DeleteChild(one);
    }
  }
  for (Element* visual = link.FirstChildElement("visual"); visual != nullptr;) {
    Element* const one = visual;
    visual = visual->NextSiblingElement("visual");
    if (is_transparent(*one) || lacks_its_file(*one, directory)) {
      notices.count("<visual> that cannot be shown, skipped");
      link.DeleteChild(one);
      continue;
    }
    const Element* const material = one->FirstChildElement("material");
    const auto colour = material == nullptr ? std::nullopt : colour_of(*material);
    one->SetName("collision");
    show(*one, colour);
    for (Element* child = one->FirstChildElement(); child != nullptr;) {
      Element* const part = child;
      child = child->NextSiblingElement();
      const bool is_kept = xml::is(*part, "pose") || xml::is(*part, "origin") || xml::is(*part, "geometry");
      if (!is_kept) one->DeleteChild(part);
    }
  }
}

// libsdformat puts the names of links before those of URDF's collisions.
bool was_visual(absl::string_view name) { return name.find(kMark) != absl::string_view::npos; }

std::optional<std::uint32_t> colour_of_visual(absl::string_view name) {
  const std::size_t mark = name.find(kMark);
  if (mark == absl::string_view::npos) return std::nullopt;
  std::uint32_t colour = 0;
  if (!absl::SimpleHexAtoi(name.substr(mark + kMark.size(), kNoColour.size()), &colour)) return std::nullopt;
  return colour;
}

}  // namespace tessera
