// Small worlds as text, and questions to what they were read as.
#pragma once

#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/programs/registry.h"
#include "worlds/loader/world_file.h"

namespace tessera {

// A folder of files, gone after the test.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::path(testing::TempDir()) /
              absl::StrCat("tessera_", getpid(), "_",
                           testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
    return path_;
  }
  operator const std::filesystem::path&() const { return path_; }  // NOLINT: a folder is its path

 private:
  std::filesystem::path path_;
};

inline std::string world(const std::string& body, const std::string& version = "1.9") {
  return absl::StrCat("<sdf version='", version, "'><world name='w'>", body, "</world></sdf>");
}

inline std::string collision(const std::string& geometry, const std::string& more = "") {
  return absl::StrCat("<collision name='c'>", more, "<geometry>", geometry, "</geometry></collision>");
}

inline const std::string kUnitBox = collision("<box><size>1 1 1</size></box>");

inline std::string model(const std::string& name, const std::string& of_model,
                         const std::string& of_link = kUnitBox) {
  return absl::StrCat("<model name='", name, "'>", of_model, "<link name='l'>", of_link, "</link></model>");
}

inline std::string model_file(const std::string& body, const std::string& version = "1.9") {
  return absl::StrCat("<sdf version='", version, "'>", body, "</sdf>");
}

inline LoadedWorld load(const std::string& xml, const std::filesystem::path& folder = "/") {
  absl::StatusOr<LoadedWorld> loaded = load_world_string(xml, folder);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? *std::move(loaded) : LoadedWorld{};
}

inline const BodyDescription& body_named(const LoadedWorld& loaded, const std::string& name) {
  for (const BodyDescription& body : loaded.world.bodies) {
    if (body.name == name) return body;
  }
  ADD_FAILURE() << "there is no body " << name;
  static const BodyDescription none;
  return none;
}

inline std::vector<std::string> names(const LoadedWorld& loaded) {
  std::vector<std::string> result;
  for (const BodyDescription& body : loaded.world.bodies) result.push_back(body.name);
  return result;
}

inline const Shape& shape_of(const LoadedWorld& loaded, const BodyDescription& body) {
  return loaded.world.shapes.at(body.properties.shape);
}

template <typename G>
G only_geometry(const LoadedWorld& loaded, const BodyDescription& body) {
  const Shape& shape = shape_of(loaded, body);
  EXPECT_EQ(shape.parts.size(), 1u);
  const G* geometry = shape.parts.empty() ? nullptr : std::get_if<G>(&shape.parts[0].geometry);
  EXPECT_NE(geometry, nullptr);
  return geometry == nullptr ? G{} : *geometry;
}

// Where a body is, from the world's origin; for worlds near it.
inline Eigen::Vector3d place(const LoadedWorld& loaded, const std::string& name) {
  return relative_to(body_named(loaded, name).pose.position, {}, loaded.world.settings.sector_size);
}

inline void expect_near(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double tolerance = 1e-12) {
  EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " is not " << b.transpose();
}

inline const char kTetrahedra[] =
    "o one\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    "o two\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 0 1\nf 5 6 7\nf 5 6 8\nf 5 7 8\nf 6 7 8\n";

// A parameter or input of a program.
inline double number_of(const ProgramRecord& record, absl::string_view name) {
  const Program& program = *find_program(record.kind);
  if (const auto parameter = place_of(name, program.parameters())) return record.parameters.at(*parameter);
  return record.inputs.at(place_of(name, program.inputs()).value());
}

}  // namespace tessera
