// What links look like: their visuals, read as if they were their collisions.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <optional>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// What the shapes of bodies are made of.
enum class ShapeSource { kCollisions, kVisuals };

// Makes collisions of the visuals of a <link> of SDF or URDF, whose names tell their colours, and takes those
// that it had away: where the mesh of a visual is not there, they stand for it. Nothing changes in a link
// that was done before.
void show_visuals(xml::Element& link, const std::filesystem::path& directory, Notices& notices);

// By the name of a collision: whether it was a visual, and its colour (0xRRGGBB) if it has one of its own.
bool was_visual(absl::string_view name);
std::optional<std::uint32_t> colour_of_visual(absl::string_view name);

}  // namespace tessera
