#include "client_sdk/cli/experiment_output.h"

#include <absl/strings/str_cat.h>

#include <fstream>

namespace tessera::cli {

absl::Status write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text << std::flush;
  return out ? absl::OkStatus() : absl::UnavailableError(absl::StrCat("cannot write ", file.string()));
}

std::filesystem::path beside(const std::filesystem::path& file, const std::string& name) {
  std::filesystem::path result = file;
  return result.replace_filename(absl::StrCat(file.stem().string(), "_", name, file.extension().string()));
}

}  // namespace tessera::cli
