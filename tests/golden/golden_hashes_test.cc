// No bit changes by accident: compares the world_hash of named scenes with golden_hashes.tsv.
//
//   golden_hashes_test --precision=f64   tests in that precision, since a process can load only one
//   golden_hashes_test --update          computes all hashes and rewrites the file
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "lpss/simulation/simulation.h"
#include "tests/golden/golden_scenes.h"

namespace tessera {
namespace {

Precision precision = Precision::kFloat32;
std::string program;

constexpr Precision kPrecisions[] = {Precision::kFloat32, Precision::kFloat64};

constexpr const char* kHeader =
    "# The world_hash of named scenes (tests/golden/golden_scenes.cc) on every machine, in both engines.\n"
    "# A line changes only where the bits of a world do, and the commit that changes it must say so and "
    "why.\n"
    "# Rewritten by `golden_hashes_test --update`.\n"
    "# scene\tengine\tticks\tworld_hash\n";

struct Golden {
  Tick ticks = 0;
  std::string hash;
};
using GoldenFile = std::map<std::pair<std::string, std::string>, Golden>;  // by scene and engine

absl::StatusOr<GoldenFile> read_file() {
  std::ifstream in(TESSERA_GOLDEN_HASHES);
  if (!in) return absl::NotFoundError(absl::StrCat("cannot read ", TESSERA_GOLDEN_HASHES));
  GoldenFile file;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    const std::vector<std::string> columns = absl::StrSplit(line, '\t');
    Golden golden;
    if (columns.size() != 4 || !absl::SimpleAtoi(columns[2], &golden.ticks)) {
      return absl::InvalidArgumentError(absl::StrCat(TESSERA_GOLDEN_HASHES, ": malformed line: ", line));
    }
    golden.hash = columns[3];
    if (!file.try_emplace({columns[0], columns[1]}, golden).second) {
      return absl::InvalidArgumentError(absl::StrCat(TESSERA_GOLDEN_HASHES, ": a second line for ", line));
    }
  }
  return file;
}

absl::Status write_file(const GoldenFile& file) {
  std::ofstream out(TESSERA_GOLDEN_HASHES);
  out << kHeader;
  for (const GoldenScene& scene : golden_scenes()) {
    for (const Precision each : kPrecisions) {
      const auto golden = file.find({scene.name, name_of(each)});
      if (golden == file.end()) continue;
      out << scene.name << '\t' << name_of(each) << '\t' << golden->second.ticks << '\t'
          << golden->second.hash << '\n';
    }
  }
  out.close();
  return out ? absl::OkStatus() : absl::UnknownError(absl::StrCat("cannot write ", TESSERA_GOLDEN_HASHES));
}

absl::StatusOr<std::string> hash_of(const GoldenScene& scene, Precision engine) {
  absl::StatusOr<WorldDescription> world = scene.world();
  if (!world.ok()) return world.status();
  world->settings.precision = engine;
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(*world);
  if (!simulation.ok()) return simulation.status();
  for (Tick tick = 1; tick <= scene.ticks; ++tick) {
    (*simulation)->step(scene.commands ? scene.commands(tick) : std::vector<Command>{});
  }
  return (*simulation)->hash().to_string();
}

// Computes the lines of one engine and keeps those of the other.
absl::Status update(Precision engine) {
  const absl::StatusOr<GoldenFile> before = read_file();
  GoldenFile file = before.ok() ? *before : GoldenFile{};
  for (const GoldenScene& scene : golden_scenes()) {
    const absl::StatusOr<std::string> hash = hash_of(scene, engine);
    if (!hash.ok()) return hash.status();
    file[{scene.name, name_of(engine)}] = {scene.ticks, *hash};
  }
  return write_file(file);
}

int update_in_both_precisions() {
  for (const Precision engine : kPrecisions) {
    const pid_t child = fork();
    if (child == 0) {
      const absl::Status status = update(engine);
      if (!status.ok()) std::fprintf(stderr, "%s\n", status.ToString().c_str());
      _exit(status.ok() ? 0 : 1);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child || status != 0) return 1;
  }
  std::printf("%s is rewritten; a commit that changes it must say so and why\n", TESSERA_GOLDEN_HASHES);
  return 0;
}

// One test for each scene, under its name.
class GoldenHash : public testing::Test {
 public:
  explicit GoldenHash(const GoldenScene& scene) : scene_(scene) {}
  void TestBody() override;

 private:
  const GoldenScene& scene_;
};

void GoldenHash::TestBody() {
  const absl::StatusOr<GoldenFile> file = read_file();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto golden = file->find({scene_.name, name_of(precision)});
  const bool known = golden != file->end() && golden->second.ticks == scene_.ticks;
  const absl::StatusOr<std::string> hash = hash_of(scene_, precision);
  ASSERT_TRUE(hash.ok()) << hash.status();
  if (known && golden->second.hash == *hash) return;
  FAIL() << "The bits of a world have changed.\n"
         << "  scene     " << scene_.name << ", " << scene_.ticks << " ticks\n"
         << "  engine    " << name_of(precision) << "\n"
         << "  expected  " << (known ? golden->second.hash : "(not in the file for this number of ticks)")
         << "\n"
         << "  got       " << *hash << "\n"
         << "If that is intended, say so in the commit message and rewrite the file:\n"
         << "  " << program << " --update";
}

void register_scenes() {
  for (const GoldenScene& scene : golden_scenes()) {
    testing::RegisterTest("GoldenHash", scene.name.c_str(), nullptr, nullptr, __FILE__, __LINE__,
                          [&scene] { return new GoldenHash(scene); });
  }
}

TEST(GoldenFile, HasEveryWorldOfOursInBothEnginesAndNothingElse) {
  std::vector<std::pair<std::string, std::string>> wanted;
  for (const GoldenScene& scene : golden_scenes()) {
    for (const Precision each : kPrecisions) wanted.emplace_back(scene.name, name_of(each));
  }
  for (const auto& entry : std::filesystem::directory_iterator(TESSERA_OWN_WORLDS)) {
    if (entry.path().extension() != ".sdf") continue;
    EXPECT_THAT(wanted, testing::Contains(testing::Pair(entry.path().stem().string(), "f32")))
        << "a world without a scene in golden_scenes.cc";
  }
  const absl::StatusOr<GoldenFile> file = read_file();
  ASSERT_TRUE(file.ok()) << file.status();
  std::vector<std::pair<std::string, std::string>> found;
  for (const auto& [key, golden] : *file) found.push_back(key);
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(wanted));
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  tessera::program = argv[0];
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--precision=f32") {
      tessera::precision = tessera::Precision::kFloat32;
    } else if (argument == "--precision=f64") {
      tessera::precision = tessera::Precision::kFloat64;
    } else if (argument == "--update") {
      return tessera::update_in_both_precisions();
    } else {
      std::fprintf(stderr, "unknown argument %s\n", argv[i]);
      return 2;
    }
  }
  tessera::register_scenes();
  return RUN_ALL_TESTS();
}
