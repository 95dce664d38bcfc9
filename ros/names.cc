#include "ros/names.h"

#include <absl/strings/ascii.h>

#include <cstddef>

#include "ros/transforms.h"

namespace tessera::ros {

std::string rest_of(const std::string& name) {
  const std::size_t colons = name.find("::");
  return colons == std::string::npos ? name : frame_name(name.substr(colons + 2));
}

std::string topic_word(absl::string_view name) {
  const bool begins = !name.empty() && !absl::ascii_isdigit(static_cast<unsigned char>(name.front()));
  std::string word = begins ? "" : "_";
  for (const char c : name) word += absl::ascii_isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return word;
}

}  // namespace tessera::ros
