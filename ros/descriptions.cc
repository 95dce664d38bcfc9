#include "ros/descriptions.h"

#include <absl/strings/str_cat.h>

#include <fstream>
#include <iterator>
#include <system_error>

#include "ros/names.h"
#include "ros/transforms.h"
#include "worlds/loader/xml.h"

namespace tessera::ros {

absl::Status publish_description(Node& node, const std::filesystem::path& file, const std::string& root) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) return absl::NotFoundError(absl::StrCat(file.string(), ": there is no such file"));
  if (bytes > kDescriptionBytesMax) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ": ", bytes, " bytes must be at most ", kDescriptionBytesMax));
  }
  const absl::StatusOr<std::unique_ptr<xml::File>> read = xml::File::read(file);
  if (!read.ok()) return read.status();
  const std::string name = xml::attribute_of(&(*read)->root(), "name");
  if (!xml::is((*read)->root(), "robot") || name.empty())
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": it is no <robot> with a name"));
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::string topic =
      name == root ? "/robot_description" : absl::StrCat("/", topic_word(name), "/robot_description");
  const absl::StatusOr<dds_entity_t> writer =
      node.writer(std_msgs_msg_dds__String__desc, topic, {.depth = 1, .is_kept = true});
  if (!writer.ok()) return writer.status();
  const std_msgs_msg_dds__String_ message{ros::text(text)};
  return write(*writer, &message, topic);
}

}  // namespace tessera::ros
