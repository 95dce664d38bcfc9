// What DDS Security is to protect on the bus between daemons, and who may join: documents that the authority
// signs.
#pragma once

namespace tessera {

// All domains that the specification knows, 0 to 230; daemons of other domains cannot join with keys.
inline constexpr const char* kGovernance = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds>
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>230</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>NONE</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";

// For the holder of the daemons' certificate; %s: the last day of the certificate.
inline constexpr const char kPermissionsFormat[] = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds>
  <permissions>
    <grant name="daemon">
      <subject_name>CN=tessera-daemon,O=Tessera</subject_name>
      <validity><not_before>2020-01-01T00:00:00</not_before><not_after>%sT00:00:00</not_after></validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>230</max></id_range></domains>
        <publish><topics><topic>*</topic></topics></publish>
        <subscribe><topics><topic>*</topic></topics></subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)";

}  // namespace tessera
