#include "cli/output_file.h"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace tessera::cli {
namespace {

std::string cannot_write(const std::filesystem::path& file, int error) {
  return absl::StrCat("cannot write \"", file.string(), "\": ", std::strerror(error));
}

// Why the file could not be written; 0 where it could.
int obstacle(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) return EISDIR;
  if (access(file.c_str(), W_OK) == 0) return 0;
  if (errno != ENOENT) return errno;
  if (!file.has_filename()) return ENOENT;
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  return access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;
}

}  // namespace

absl::StatusOr<std::filesystem::path> parse_output_file(const std::string& text) {
  const std::filesystem::path file = text;
  if (const int error = obstacle(file); error != 0)
    return absl::InvalidArgumentError(cannot_write(file, error));
  return file;
}

absl::Status write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.close();
  return out ? absl::OkStatus() : absl::UnavailableError(cannot_write(file, errno));
}

absl::Status write_json(const std::filesystem::path& file, const nlohmann::json& json) {
  return write_text(file, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace tessera::cli
