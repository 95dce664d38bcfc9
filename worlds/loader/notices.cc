#include "worlds/loader/notices.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "lpss/base/utf8.h"

namespace tessera {
namespace {

// "3 joints (1 ball, 2 revolute)".
std::string summary(const std::map<std::string, std::size_t>& counts) {
  std::size_t total = 0;
  std::string types;
  for (const auto& [type, n] : counts) {
    total += n;
    absl::StrAppend(&types, types.empty() ? "" : ", ", n, " ", type);
  }
  return absl::StrCat(total, total == 1 ? " joint (" : " joints (", types, ")");
}

// Lists are no longer than this.
constexpr std::size_t kNamedMax = 20;

// "a, b and 3 more".
std::string some_of(const std::vector<std::string>& all) {
  const std::size_t named = std::min(all.size(), kNamedMax);
  const std::string list = absl::StrJoin(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(named), ", ");
  return named == all.size() ? list : absl::StrCat(list, " and ", all.size() - named, " more");
}

// "12 x <include> of the network, skipped: 2 models are not in Gazebo's cache: a, b".
std::string summary_of_remote(const std::map<std::string, std::size_t>& models) {
  std::size_t total = 0;
  std::vector<std::string> uris;
  for (const auto& [uri, n] : models) {
    total += n;
    uris.push_back(uri);
  }
  return absl::StrCat(total, " x <include> of the network, skipped: ", uris.size(),
                      uris.size() == 1 ? " model is" : " models are",
                      " not in Gazebo's cache: ", some_of(uris));
}

std::string printable(std::string line) { return is_utf8(line) ? line : absl::CHexEscape(line); }

}  // namespace

void Notices::count_repair(const std::string& kind, const std::string& where) {
  Repair& repair = repairs_.try_emplace(kind, Repair{0, where}).first->second;
  ++repair.times;
}

void Notices::count_missing_file(const std::string& uri, const std::string& place, absl::string_view why) {
  std::string what = absl::StrCat(place, ": '", uri, "'");
  if (missing_.insert(what).second)
    missing_files_.emplace_back(std::move(what), absl::StrCat(place, ": ", why));
}

void Notices::add(const Notices& other) {
  for (const auto& [kind, n] : other.kinds_) kinds_[kind] += n;
  for (const auto& [kind, more] : other.repairs_) {
    repairs_.try_emplace(kind, Repair{0, more.where}).first->second.times += more.times;
  }
  for (const auto& [type, n] : other.joints_) joints_[type] += n;
  for (const auto& [type, n] : other.joints_left_out_) joints_left_out_[type] += n;
  for (const auto& [kind, n] : other.losses_) losses_[kind] += n;
  for (const auto& [uri, n] : other.remote_models_) remote_models_[uri] += n;
  for (const auto& missing : other.missing_files_) {
    if (missing_.insert(missing.first).second) missing_files_.push_back(missing);
  }
}

std::vector<std::string> Notices::lines() const {
  std::vector<std::string> result;
  for (const auto& [kind, n] : kinds_) result.push_back(printable(absl::StrCat(n, " x ", kind)));
  if (!joints_.empty()) result.push_back(printable(absl::StrCat(summary(joints_), " simulated")));
  if (!joints_left_out_.empty()) {
    result.push_back(
        printable(absl::StrCat(summary(joints_left_out_), " not simulated: their links move freely")));
  }
  for (std::string& loss : losses()) result.push_back(std::move(loss));
  return result;
}

std::vector<std::string> Notices::losses() const {
  std::vector<std::string> result;
  for (const auto& [kind, n] : losses_) result.push_back(printable(absl::StrCat(n, " x ", kind)));
  if (!remote_models_.empty()) result.push_back(printable(summary_of_remote(remote_models_)));
  return result;
}

absl::Status Notices::missing_files() const {
  if (missing_files_.empty()) return absl::OkStatus();
  const std::string& first = missing_files_.front().second;
  if (missing_files_.size() == 1) return absl::NotFoundError(printable(first));
  std::vector<std::string> others;
  for (std::size_t n = 1; n < missing_files_.size(); ++n) others.push_back(missing_files_[n].first);
  return absl::NotFoundError(printable(
      absl::StrCat(missing_files_.size(), " files were not found: ", first, "; and ", some_of(others))));
}

std::vector<std::string> Notices::repairs() const {
  std::vector<std::string> result;
  for (const auto& [kind, repair] : repairs_) {
    const std::string first = repair.times > 1 ? "; first: " : ": ";
    result.push_back(printable(absl::StrCat(repair.times, " x ", kind, first, repair.where)));
  }
  return result;
}

}  // namespace tessera
