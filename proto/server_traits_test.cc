#include "proto/server_traits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using testing::HasSubstr;

std::string error(const Labels& labels) { return std::string(check_labels(labels).message()); }

TEST(ServerTraits, LabelsAreKeysWithValues) {
  EXPECT_TRUE(check_labels({}).ok());
  EXPECT_TRUE(check_labels({"zone=eu-1", "rack=a7", "example.org/disk=ssd_2"}).ok());
  for (const char* label : {"", "zone", "zone=", "=eu", "zone=a=b", "zo ne=eu", "zone=\x01", "zone=\xc3\xbc"})
    EXPECT_THAT(error({label}), HasSubstr("must be key=value")) << label;
}

TEST(ServerTraits, LabelsHaveBounds) {
  EXPECT_THAT(error({"zone=" + std::string(kLabelBytesMax, 'a')}),
              HasSubstr("133 bytes must have at most 128"));
  Labels many;
  for (std::size_t n = 0; n <= kLabelsMax; ++n) many.push_back("key" + std::to_string(n) + "=1");
  EXPECT_THAT(error(many), HasSubstr("the 17 labels must be at most 16"));
  EXPECT_THAT(error({"zone=eu", "zone=us"}), HasSubstr("\"zone\" is given twice"));
}

TEST(ServerTraits, AServerIsFitThatHasAllRequiredLabels) {
  const Labels labels = {"zone=eu", "rack=a7"};
  EXPECT_TRUE(has_all(labels, {}));
  EXPECT_TRUE(has_all(labels, {"rack=a7", "zone=eu"}));
  EXPECT_FALSE(has_all(labels, {"zone=us"}));
  EXPECT_FALSE(has_all(labels, {"zone=eu", "disk=ssd"}));
}

}  // namespace
}  // namespace tessera
