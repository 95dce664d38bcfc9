#include "coordinator/frame_registry.h"

#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {

FrameRegistry::FrameRegistry(std::span<const FrameDescription> frames, std::span<const BodyRecord> records) {
  for (const FrameDescription& frame : frames) {
    invariant(frame.body < records.size(), "every frame of a world has a body");
    insert(frame.name, {records[frame.body].id, frame.pose});
  }
}

FrameRegistry::FrameRegistry(const WorldCatalogue& catalogue) {
  for (const WorldCatalogue::Frame& frame : catalogue.frames) insert(frame.name, {frame.body, frame.pose});
}

void FrameRegistry::insert(const std::string& name, const Entry& entry) {
  by_body_.emplace(entry.body, name);
  invariant(frames_.try_emplace(name, entry).second, "names of frames are unique");
}

void FrameRegistry::add(const std::string& name, const Entry& entry, Undo& undo) {
  insert(name, entry);
  undo.add([this, name, body = entry.body] {
    frames_.erase(name);
    by_body_.erase({body, name});
  });
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

void FrameRegistry::remove_of(BodyId body, Undo& undo) {
  auto frame = by_body_.lower_bound({body, std::string()});
  while (frame != by_body_.end() && frame->first == body) {
    const auto found = frames_.find(frame->second);
    undo.add([this, name = found->first, entry = found->second] { insert(name, entry); });
    frames_.erase(found);
    frame = by_body_.erase(frame);
  }
}

}  // namespace tessera
