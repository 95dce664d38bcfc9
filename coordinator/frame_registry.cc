#include "coordinator/frame_registry.h"

#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {

FrameRegistry::FrameRegistry(std::vector<FrameDescription> frames, std::span<const BodyRecord> records) {
  for (FrameDescription& frame : frames) {
    invariant(frame.body < records.size(), "every frame of a world has a body");
    const BodyId body = records[frame.body].id;
    by_body_.emplace(body, frame.name);
    const bool is_new = frames_.try_emplace(std::move(frame.name), Entry{body, frame.pose}).second;
    invariant(is_new, "names of frames are unique");
  }
}

FrameRegistry::FrameRegistry(const WorldCatalogue& catalogue) {
  for (const WorldCatalogue::Frame& frame : catalogue.frames) {
    by_body_.emplace(frame.body, frame.name);
    frames_.try_emplace(frame.name, Entry{frame.body, frame.pose});
  }
}

void FrameRegistry::describe(WorldCatalogue& catalogue) const {
  for (const auto& [name, entry] : frames_) catalogue.frames.push_back({name, entry.body, entry.pose});
}

const FrameRegistry::Entry* FrameRegistry::find(std::string_view name) const {
  const auto found = frames_.find(name);
  return found == frames_.end() ? nullptr : &found->second;
}

std::vector<std::pair<std::string_view, const FrameRegistry::Entry*>> FrameRegistry::with_prefix(
    std::string_view prefix, std::size_t limit) const {
  std::vector<std::pair<std::string_view, const Entry*>> found;
  for (auto frame = frames_.lower_bound(prefix); frame != frames_.end() && found.size() < limit; ++frame) {
    if (!std::string_view(frame->first).starts_with(prefix)) break;
    found.emplace_back(frame->first, &frame->second);
  }
  return found;
}

void FrameRegistry::remove_of(BodyId body) {
  auto frame = by_body_.lower_bound({body, std::string()});
  while (frame != by_body_.end() && frame->first == body) {
    frames_.erase(frame->second);
    frame = by_body_.erase(frame);
  }
}

}  // namespace tessera
