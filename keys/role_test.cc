#include "keys/role.h"

#include <gtest/gtest.h>

#include "standby.pb.h"
#include "tessera.pb.h"

namespace tessera {
namespace {

TEST(RoleTest, NamesAreReadBack) {
  for (const ClientRole role : {ClientRole::kObserve, ClientRole::kControl, ClientRole::kAdmin})
    EXPECT_EQ(parse_role(name_of(role)), role);
  EXPECT_EQ(parse_role("root"), std::nullopt);
  EXPECT_EQ(parse_role(""), std::nullopt);
}

TEST(RoleTest, EveryCallOfEveryServiceHasOne) {
  int services = 0;
  for (const auto* file : {v1::StatusRequest::descriptor()->file(), v1::StatesHeld::descriptor()->file()}) {
    services += file->service_count();
    for (int s = 0; s < file->service_count(); ++s) {
      const google::protobuf::ServiceDescriptor& service = *file->service(s);
      for (int m = 0; m < service.method_count(); ++m) {
        const std::string call = "/" + service.full_name() + "/" + service.method(m)->name();
        EXPECT_TRUE(role_needed(call)) << call << " is in no role: see kCalls in role.cc";
      }
    }
  }
  EXPECT_EQ(services, 3);
}

// Whether a request changes a world is clear only when it is read.
TEST(RoleTest, WhoObservesMayMakeRequests) {
  for (const char* call : {"/tessera.v1.Tessera/Session", "/tessera.v1.Tessera/Do"})
    EXPECT_EQ(role_needed(call), ClientRole::kObserve) << call;
}

TEST(RoleTest, OtherCallsHaveNone) {
  for (const char* call :
       {"", "/", "/tessera.v1.", "/tessera.v1.Tessera/", "/tessera.v1.Tessera/Explode", "Tessera/GetStatus",
        "/other.Tessera/GetStatus", "/tessera.v1.Tessera/GetStatus/"}) {
    EXPECT_FALSE(role_needed(call)) << call;
  }
}

}  // namespace
}  // namespace tessera
