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

bool is_ready(const std::shared_future<Looks>& looks) {
  return looks.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

FileLooks::FileLooks(const std::filesystem::path& file) { show(file); }

void FileLooks::show(const std::filesystem::path& file) {
  std::shared_future<Looks> next =
      std::async(file.empty() ? std::launch::deferred : std::launch::async, read, file).share();
  const std::lock_guard lock(mutex_);
  file_ = file;
  if (looks_.valid()) ++files_before_;
  std::swap(looks_, next);
}

std::uint64_t FileLooks::files_read() const {
  const std::lock_guard lock(mutex_);
  return files_before_ + (is_ready(looks_) ? 1 : 0);
}

std::filesystem::path FileLooks::file() const {
  const std::lock_guard lock(mutex_);
  return file_;
}

std::shared_future<Looks> FileLooks::looks() const {
  const std::lock_guard lock(mutex_);
  return looks_;
}

std::shared_ptr<const Look> FileLooks::of(const std::string& world, const std::string& body) const {
  const std::shared_future<Looks> future = looks();
  if (!is_ready(future)) return nullptr;
  const Looks& looks = future.get();
  if (looks.world != world) return nullptr;
  const auto found = looks.bodies.find(body);
  return found == looks.bodies.end() ? nullptr : found->second;
}

}  // namespace tessera::viewer
