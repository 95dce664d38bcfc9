#include "cli/experiment_output.h"

#include <absl/strings/str_cat.h>

namespace tessera::cli {

std::filesystem::path beside(const std::filesystem::path& file, const std::string& name) {
  std::filesystem::path result = file;
  return result.replace_filename(absl::StrCat(file.stem().string(), "_", name, file.extension().string()));
}

}  // namespace tessera::cli
