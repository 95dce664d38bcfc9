#include "worlds/loader/notices.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

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

std::string printable(std::string line) { return is_utf8(line) ? line : absl::CHexEscape(line); }

}  // namespace

void Notices::count_repair(const std::string& kind, const std::string& where) {
  Repair& repair = repairs_.try_emplace(kind, Repair{0, where}).first->second;
  ++repair.times;
}

void Notices::add(const Notices& other) {
  for (const auto& [kind, n] : other.kinds_) kinds_[kind] += n;
  for (const auto& [kind, more] : other.repairs_) {
    repairs_.try_emplace(kind, Repair{0, more.where}).first->second.times += more.times;
  }
  for (const auto& [type, n] : other.joints_) joints_[type] += n;
  for (const auto& [type, n] : other.joints_left_out_) joints_left_out_[type] += n;
}

std::vector<std::string> Notices::lines() const {
  std::vector<std::string> result;
  for (const auto& [kind, n] : kinds_) result.push_back(printable(absl::StrCat(n, " x ", kind)));
  if (!joints_.empty()) result.push_back(printable(absl::StrCat(summary(joints_), " simulated")));
  if (!joints_left_out_.empty()) {
    result.push_back(
        printable(absl::StrCat(summary(joints_left_out_), " not simulated: their links move freely")));
  }
  return result;
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
