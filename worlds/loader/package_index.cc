#include "worlds/loader/package_index.h"

#include <algorithm>
#include <system_error>
#include <vector>

#include "worlds/loader/xml.h"

namespace tessera {
namespace {

using std::filesystem::path;

constexpr std::uintmax_t kManifestBytesMax = 1 << 20;

// The name in a package.xml; empty if there is no such file, or it has none.
std::string name_of_package(const path& folder) {
  const path manifest = folder / "package.xml";
  std::error_code error;
  if (!std::filesystem::is_regular_file(manifest, error)) return "";
  if (std::filesystem::file_size(manifest, error) > kManifestBytesMax || error) return "";
  auto file = xml::File::read(manifest);
  return file.ok() ? xml::child_text((*file)->root(), "name") : "";
}

std::vector<path> folders_in(const path& folder) {
  std::vector<path> result;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unknown;
    const bool is_hidden = entry->path().filename().string().starts_with('.');
    if (!is_hidden && entry->is_directory(unknown) && !entry->is_symlink(unknown))
      result.push_back(entry->path());
  }
  std::ranges::sort(result);
  return result;
}

}  // namespace

void PackageIndex::read(const path& folder, int levels, Names& names) {
  std::vector<path> level{folder};
  for (int n = 0; n < levels; ++n) {
    std::vector<path> next;
    for (const path& above : level) {
      for (const path& below : folders_in(above)) {
        if (++folders_ > kFoldersMax) return;
        if (const std::string name = name_of_package(below); !name.empty()) {
          names.try_emplace(name, below);
        } else {
          next.push_back(below);
        }
      }
    }
    level = std::move(next);
  }
}

path PackageIndex::find(const path& folder, int levels, const std::string& name) {
  const auto [index, is_new] = indices_.try_emplace({folder, levels});
  if (is_new) read(folder, levels, index->second);
  const auto found = index->second.find(name);
  return found == index->second.end() ? path() : found->second;
}

}  // namespace tessera
