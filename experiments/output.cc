#include "experiments/output.h"

#include <absl/strings/str_cat.h>

namespace tessera::experiments {

std::filesystem::path beside(const std::filesystem::path& file, const std::string& name) {
  std::filesystem::path result = file;
  return result.replace_filename(absl::StrCat(file.stem().string(), "_", name, file.extension().string()));
}

}  // namespace tessera::experiments
