// Keys for the time of a test.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "keys/make_keys.h"

namespace tessera {

class TestKeys {
 public:
  explicit TestKeys(std::vector<std::string> hosts = {}) {
    std::string name = ::testing::TempDir() + "tessera-keys-XXXXXX";
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    parent_ = name;
    const absl::Status made = make_keys({.folder = folder(), .hosts = std::move(hosts), .days = 2});
    EXPECT_TRUE(made.ok()) << made;
  }
  ~TestKeys() { std::filesystem::remove_all(parent_); }
  TestKeys(const TestKeys&) = delete;
  TestKeys& operator=(const TestKeys&) = delete;

  std::filesystem::path folder() const { return parent_ / "keys"; }

 private:
  std::filesystem::path parent_;
};

}  // namespace tessera
