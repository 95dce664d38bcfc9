#include "worlds/mjcf/names.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>

#include "lpss/base/utf8.h"
#include "worlds/loader/model_file.h"

namespace tessera::mjcf {

std::string fit_name(const std::string& name, const std::string& otherwise) {
  if (name.empty() || name.size() > kModelNameBytesMax || !is_utf8(name)) return otherwise;
  return absl::StrReplaceAll(name, {{"::", "_"}, {" ", "_"}});
}

std::string Names::unique(const std::string& name) {
  std::string result = absl::StrCat(model_, "::", name);
  for (int n = 2; !taken_.insert(result).second; ++n) result = absl::StrCat(model_, "::", name, "_", n);
  return result;
}

}  // namespace tessera::mjcf
