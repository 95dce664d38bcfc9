// What comes by a topic, as bytes.
#pragma once

#include <absl/strings/escaping.h>

#include <string>

#include "dds/dds.h"
#include "dds/ddsi/ddsi_serdata.h"

namespace tessera::ros {

// The next message of a topic as received, in hexadecimal digits.
inline std::string next_message(dds_entity_t reader) {
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  const dds_entity_t participant = dds_get_participant(reader);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, reader, 0);
  dds_waitset_wait(waitset, nullptr, 0, DDS_SECS(60));
  dds_delete(waitset);
  ddsi_serdata* message = nullptr;
  dds_sample_info_t info;
  if (dds_takecdr(reader, &message, 1, &info, DDS_ANY_STATE) != 1) return "";
  std::string bytes(ddsi_serdata_size(message), '\0');
  ddsi_serdata_to_ser(message, 0, bytes.size(), bytes.data());
  ddsi_serdata_unref(message);
  return absl::BytesToHexString(bytes);
}

}  // namespace tessera::ros
