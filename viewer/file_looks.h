// What the bodies of a world look like, by its file.
#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <string>

#include "worlds/loader/look.h"

namespace tessera::viewer {

// Thread-safe.
class FileLooks {
 public:
  // Reads the file in the background; what is wrong with it is in the log. Without a file, nothing has a
  // look.
  explicit FileLooks(const std::filesystem::path& file);

  bool is_read() const;

  // Null for a body that has none, in a world of another name, and until the file is read.
  std::shared_ptr<const Look> of(const std::string& world, const std::string& body) const;

 private:
  std::shared_future<Looks> looks_;
};

}  // namespace tessera::viewer
