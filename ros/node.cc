#include "ros/node.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/log.h"
#include "lpss/base/invariant.h"
#include "transport/dds_domain.h"

namespace tessera::ros {
namespace {

// A ROS node would wait for slow readers forever; we continue with newer messages.
constexpr dds_duration_t kWriteWait = DDS_MSECS(100);

constexpr auto kTypeHashes = std::to_array<std::pair<absl::string_view, absl::string_view>>({
#include "ros/type_hashes.inc"
});

// What ROS's nodes find out about an endpoint, in its USER_DATA: from Jazzy on, they warn of those that do
// not say which type they mean.
std::string user_data_of(const dds_topic_descriptor_t& type, absl::string_view before = "") {
  const auto* const found = std::ranges::find(kTypeHashes, absl::string_view(type.m_typename),
                                              &decltype(kTypeHashes)::value_type::first);
  invariant(found != kTypeHashes.end(), "each type has a hash");
  return absl::StrCat(before, "typehash=", found->second, ";");
}

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Qos qos_of(const Profile& profile, const std::string& user_data) {
  Qos owned(dds_create_qos(), dds_delete_qos);
  dds_qos_t* const qos = owned.get();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kWriteWait);
  dds_qset_durability(qos, profile.is_kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, profile.depth);
  const dds_data_representation_id_t encoding = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &encoding);
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  return owned;
}

}  // namespace

absl::StatusOr<std::pair<std::string, std::string>> parse_remap(const std::string& text) {
  const std::pair<std::string, std::string> names = absl::StrSplit(text, absl::MaxSplits(":=", 1));
  for (const std::string& name : {names.first, names.second}) {
    const bool is_one = name.size() > 1 && name.front() == '/' && std::ranges::all_of(name, [](char c) {
                          return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '/';
                        });
    if (!is_one)
      return absl::InvalidArgumentError(
          absl::StrCat("'", text, "' must be /NAME:=/OTHER, of letters, digits, '_' and '/'"));
  }
  return names;
}

std::string Node::dds_name(absl::string_view prefix, const std::string& name,
                           absl::string_view suffix) const {
  const auto other = remaps_.find(name);
  return absl::StrCat(prefix, other == remaps_.end() ? name : other->second, suffix);
}

absl::StatusOr<std::unique_ptr<Node>> Node::open(std::uint32_t domain, Remaps remaps) {
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  if (participant < 0) return dds_error(participant, absl::StrCat("cannot open DDS domain ", domain));
  return std::unique_ptr<Node>(new Node(participant, std::move(remaps)));
}

Node::~Node() { dds_delete(participant_); }

absl::StatusOr<dds_entity_t> Node::write_to(const dds_topic_descriptor_t& type, const std::string& dds_name,
                                            const dds_qos_t* qos) {
  const dds_entity_t entity = dds_create_topic(participant_, &type, dds_name.c_str(), nullptr, nullptr);
  if (entity < 0) return dds_error(entity, absl::StrCat("cannot create the topic ", dds_name));
  const dds_entity_t writer = dds_create_writer(participant_, entity, qos, nullptr);
  if (writer < 0) return dds_error(writer, absl::StrCat("cannot publish ", dds_name));
  return writer;
}

absl::StatusOr<dds_entity_t> Node::read_from(const dds_topic_descriptor_t& type, const std::string& dds_name,
                                             const dds_qos_t* qos, std::function<void()> on_data) {
  const dds_entity_t entity = dds_create_topic(participant_, &type, dds_name.c_str(), nullptr, nullptr);
  if (entity < 0) return dds_error(entity, absl::StrCat("cannot create the topic ", dds_name));
  const std::function<void()>* call = nullptr;
  {
    const std::lock_guard lock(mutex_);
    call = &listeners_.emplace_back(std::move(on_data));
  }
  dds_listener_t* const listener = dds_create_listener(const_cast<std::function<void()>*>(call));
  const absl::Cleanup delete_listener = [listener] { dds_delete_listener(listener); };
  dds_lset_data_available(listener, [](dds_entity_t, void* argument) {
    (*static_cast<const std::function<void()>*>(argument))();
  });
  const dds_entity_t reader = dds_create_reader(participant_, entity, qos, listener);
  if (reader < 0) return dds_error(reader, absl::StrCat("cannot subscribe to ", dds_name));
  return reader;
}

absl::StatusOr<dds_entity_t> Node::writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                          const Profile& profile) {
  const Qos qos = qos_of(profile, user_data_of(type));
  dds_qset_writer_data_lifecycle(qos.get(), /*autodispose=*/false);
  return write_to(type, dds_name("rt", topic), qos.get());
}

absl::StatusOr<dds_entity_t> Node::reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                          std::function<void()> on_data, const Profile& profile) {
  const Qos qos = qos_of(profile, user_data_of(type));
  return read_from(type, dds_name("rt", topic), qos.get(), std::move(on_data));
}

absl::StatusOr<ServiceEnds> Node::service(const dds_topic_descriptor_t& request,
                                          const dds_topic_descriptor_t& reply, const std::string& name,
                                          std::function<void()> on_request) {
  // By this, a client knows which reader and writer belong together.
  dds_guid_t guid{};
  if (const dds_return_t rc = dds_get_guid(participant_, &guid); rc < 0)
    return dds_error(rc, "cannot identify the DDS participant");
  const absl::string_view id(reinterpret_cast<const char*>(guid.v), sizeof(guid.v));
  const std::string service = absl::StrCat("serviceid=", absl::BytesToHexString(id), ".", name, ";");
  absl::StatusOr<dds_entity_t> replies =
      write_to(reply, dds_name("rr", name, "Reply"), qos_of({}, user_data_of(reply, service)).get());
  if (!replies.ok()) return replies.status();
  absl::StatusOr<dds_entity_t> requests =
      read_from(request, dds_name("rq", name, "Request"), qos_of({}, user_data_of(request, service)).get(),
                std::move(on_request));
  if (!requests.ok()) return requests.status();
  return ServiceEnds{*requests, *replies};
}

void warn(const absl::Status& status) {
  if (!status.ok()) log_warning(status.message());
}

absl::Status write(dds_entity_t writer, const void* message, absl::string_view topic) {
  const dds_return_t rc = dds_write(writer, message);
  return rc < 0 ? dds_error(rc, absl::StrCat("cannot publish ", topic)) : absl::OkStatus();
}

bool has_reader(dds_entity_t writer) {
  dds_publication_matched_status_t matched{};
  return dds_get_publication_matched_status(writer, &matched) == DDS_RETCODE_OK && matched.current_count > 0;
}

void await_reader(dds_entity_t writer, dds_duration_t most) {
  if (has_reader(writer)) return;
  dds_set_status_mask(writer, DDS_PUBLICATION_MATCHED_STATUS);
  const dds_entity_t waitset = dds_create_waitset(dds_get_participant(writer));
  dds_waitset_attach(waitset, writer, 0);
  dds_waitset_wait(waitset, nullptr, 0, most);
  dds_delete(waitset);
}

}  // namespace tessera::ros
