#include "viewer/file_looks.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

#include "daemon/log.h"
#include "worlds/loader/world_file.h"

namespace tessera::viewer {
namespace {

Looks read(const std::filesystem::path& file) {
  if (file.empty()) return {};
  absl::StatusOr<Looks> looks = load_looks(file);
  if (looks.ok()) return *std::move(looks);
  log_warning(absl::StrCat("bodies are shown by their collision shapes: ", looks.status().message()));
  return {};
}

}  // namespace

FileLooks::FileLooks(const std::filesystem::path& file)
    : looks_(std::async(file.empty() ? std::launch::deferred : std::launch::async, read, file).share()) {}

bool FileLooks::is_read() const {
  return looks_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

std::shared_ptr<const Look> FileLooks::of(const std::string& world, const std::string& body) const {
  if (!is_read()) return nullptr;
  const Looks& looks = looks_.get();
  if (looks.world != world) return nullptr;
  const auto found = looks.bodies.find(body);
  return found == looks.bodies.end() ? nullptr : found->second;
}

}  // namespace tessera::viewer
