// What the bodies of a world look like, by its file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <string>

#include "worlds/loader/look.h"

namespace tessera::viewer {

// Thread-safe.
class FileLooks {
 public:
  // Reads the file in the background; what is wrong with it is in the log. Without a file, nothing has a
  // look.
  explicit FileLooks(const std::filesystem::path& file);

  // From now on the looks of this file. What was told of the bodies before is void once it is read.
  void show(const std::filesystem::path& file);

  // How many files have been read; whoever has told of looks tells anew when it changes.
  std::uint64_t files_read() const;

  std::filesystem::path file() const;

  // Null for a body that has none, in a world of another name, and until the file is read.
  std::shared_ptr<const Look> of(const std::string& world, const std::string& body) const;

 private:
  std::shared_future<Looks> looks() const;

  mutable std::mutex mutex_;
  std::filesystem::path file_;
  std::uint64_t files_before_ = 0;
  std::shared_future<Looks> looks_;
};

}  // namespace tessera::viewer
