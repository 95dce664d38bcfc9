// `tessera run --trajectory`: the rows are the same with and without servers, and right.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::AllOf;
using ::testing::HasSubstr;

using Row = std::map<std::string, std::string>;  // by the names of columns

double number(const Row& row, const std::string& column) {
  double value = 0;
  EXPECT_TRUE(absl::SimpleAtod(row.at(column), &value)) << column << ": " << row.at(column);
  return value;
}

class TrajectoryTest : public ::testing::Test {
 protected:
  TrajectoryTest() : folder_(cli::make_temporary_folder().value()) {}
  ~TrajectoryTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string text_of(std::vector<std::string> arguments) const {
    const std::string file = (folder_ / "way.csv").string();
    arguments.insert(arguments.begin(), "run");
    arguments.insert(arguments.end(), {"--trajectory", file});
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }
  std::vector<Row> rows_of(const std::vector<std::string>& arguments) const {
    const std::vector<std::string> lines = absl::StrSplit(text_of(arguments), '\n', absl::SkipEmpty());
    const std::vector<std::string> columns = absl::StrSplit(lines.at(0), ',');
    std::vector<Row> rows;
    for (std::size_t line = 1; line < lines.size(); ++line) {
      const std::vector<std::string> cells = absl::StrSplit(lines[line], ',');
      EXPECT_EQ(cells.size(), columns.size()) << lines[line];
      Row& row = rows.emplace_back();
      for (std::size_t cell = 0; cell < cells.size(); ++cell) row[columns.at(cell)] = cells[cell];
    }
    return rows;
  }
  // Sectors of 10 m. The centre of mass of the dumb-bell is 0.5 m along x from its frame.
  std::string flying_world() const {
    const std::filesystem::path file = folder_ / "flying.sdf";
    std::ofstream(file) << R"(<sdf version='1.9' xmlns:tessera='https://tessera.dev/sdf'><world name='flying'>
      <tessera:settings><sector_size>10</sector_size></tessera:settings>
      <gravity>0 0 -9.81</gravity>
      <model name='floor'><static>true</static><pose>0 0 -70 0 0 0</pose><link name='l'><collision name='c'>
        <geometry><box><size>4 4 1</size></box></geometry></collision></link></model>
      <model name='ball'><pose>14.5 -3 0.25 0 0 0</pose><tessera:velocity linear='0 2 0'/><link name='l'>
        <inertial><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.2</iyy><izz>0.2</izz></inertia></inertial>
        <collision name='c'><geometry><sphere><radius>0.3</radius></sphere></geometry></collision></link></model>
      <model name='bell'><tessera:velocity linear='0 -0.75 0' angular='0 0 1.5'/><link name='l'><pose>0 0 0 0 0 0</pose>
        <inertial><pose>0.5 0 0 0 0 0</pose><mass>2</mass>
          <inertia><ixx>0.2</ixx><iyy>0.2</iyy><izz>0.2</izz></inertia></inertial>
        <collision name='c'><geometry><sphere><radius>0.3</radius></sphere></geometry></collision></link></model>
      </world></sdf>)";
    return file.string();
  }

  std::filesystem::path folder_;
};

TEST_F(TrajectoryTest, IsTheSameOnAnyNumberOfServers) {
  const std::string world = world_file("seam.sdf").string();
  for (const char* precision : {"f32", "f64"}) {
    const std::vector<std::string> common = {world,     "--seconds", "1.6", "--engine",
                                             precision, "--shuffle", "9"};
    const auto text = [&](std::vector<std::string> more) {
      more.insert(more.begin(), common.begin(), common.end());
      return text_of(more);
    };
    const std::string alone = text({"--in-process"});
    const auto lines = std::count(alone.begin(), alone.end(), '\n');
    EXPECT_GT(lines, 97) << "a header, and ticks 0 to 96";
    EXPECT_EQ((lines - 1) % 97, 0);
    EXPECT_TRUE(alone == text({"--servers", "3"}));
    EXPECT_TRUE(alone == text({"--servers", "1"}));
    const std::string chosen = text({"--in-process", "--bodies", "tower_1::box_?,ground*", "--every", "7"});
    EXPECT_TRUE(chosen == text({"--servers", "3", "--bodies", "tower_1::box_?,ground*", "--every", "7"}));
    EXPECT_THAT(chosen, HasSubstr(",ground::"));
  }
}

TEST_F(TrajectoryTest, TellsWhereBodiesAreAndHowTheyMove) {
  const std::string world = flying_world();
  for (const char* precision : {"f32", "f64"}) {
    const std::vector<Row> rows = rows_of({world, "--in-process", "--seconds", "1", "--engine", precision});
    ASSERT_EQ(rows.size(), 2u * 61u) << "static bodies are left out";
    for (std::size_t n = 0; n < rows.size(); ++n) {
      EXPECT_EQ(rows[n].at("tick"), absl::StrCat(n / 2));
      EXPECT_EQ(rows[n].at("body"), n % 2 == 0 ? "ball::l" : "bell::l") << "in the order of the file";
      EXPECT_NEAR(number(rows[n], "time"), static_cast<double>(n / 2) / 60, 1e-12);
      EXPECT_EQ(rows[n].at("asleep"), "0");
    }
    const Row& start = rows[0];
    for (const auto& [column, value] : std::map<std::string, double>{{"sector_i", 1},
                                                                     {"sector_j", 0},
                                                                     {"sector_k", 0},
                                                                     {"x", 4.5},
                                                                     {"y", -3},
                                                                     {"z", 0.25},
                                                                     {"qw", 1},
                                                                     {"vy", 2}})
      EXPECT_EQ(number(start, column), value) << column;
    const Row& end = rows[120];
    EXPECT_EQ(end.at("sector_i"), "1");
    EXPECT_NEAR(number(end, "y") + 10 * number(end, "sector_j"), -1, 1e-5);
    EXPECT_NEAR(number(end, "z") + 10 * number(end, "sector_k"), 0.25 - 9.81 / 2, 0.1);
    EXPECT_NEAR(number(end, "vy"), 2, 1e-5);
    EXPECT_NEAR(number(end, "vz"), -9.81, 1e-4);
    // The frame turns about the centre of mass, which falls straight down.
    const Row& bell = rows[121];
    EXPECT_NEAR(number(bell, "x"), 0.5 - 0.5 * std::cos(1.5), 1e-3);
    EXPECT_NEAR(number(bell, "y"), -0.5 * std::sin(1.5), 1e-3);
    EXPECT_NEAR(number(bell, "vx"), 0, 1e-5);
    EXPECT_NEAR(number(bell, "qz"), std::sin(0.75), 1e-3);
    EXPECT_NEAR(number(bell, "wz"), 1.5, 1e-4);
  }
}

TEST_F(TrajectoryTest, ChoosesBodiesAndTicks) {
  const std::string world = flying_world();
  const std::vector<Row> rows =
      rows_of({world, "--in-process", "--seconds", "0.5", "--bodies", "floor*,b?ll::l", "--every", "8"});
  ASSERT_EQ(rows.size(), 3u * 4u);
  EXPECT_EQ(rows[9].at("tick"), "24");
  EXPECT_EQ(rows[9].at("body"), "floor::l") << "static, but named";
  EXPECT_EQ(number(rows[9], "sector_k"), -7);
  EXPECT_EQ(rows[10].at("body"), "ball::l");
  const std::vector<Row> plain = rows_of({world, "--plain", "--seconds", "0.5"});
  ASSERT_EQ(plain.size(), 2u * 31u);
  EXPECT_NEAR(number(plain.back(), "vz"), -9.81 / 2, 1e-3);
}

TEST_F(TrajectoryTest, GoesOnWhereASnapshotEnds) {
  const std::string world = world_file("falling.sdf").string();
  const std::string snapshot = (folder_ / "at_30.snapshot").string();
  ASSERT_EQ(run_tessera({"run", world, "--in-process", "--seconds", "0.5", "--snapshot", snapshot}).code, 0);
  const std::string whole = text_of({world, "--in-process", "--seconds", "1"});
  const std::string rest = text_of({"--from", snapshot, "--in-process", "--seconds", "0.5"});
  const std::string header = whole.substr(0, whole.find('\n'));
  EXPECT_EQ(rest.substr(0, rest.find('\n')), header);
  const std::size_t at_30 = whole.find("\n30,");
  ASSERT_NE(at_30, std::string::npos);
  EXPECT_TRUE(rest == header + whole.substr(at_30));
  EXPECT_TRUE(rest == text_of({"--from", snapshot, "--servers", "2", "--seconds", "0.5"}));
}

TEST_F(TrajectoryTest, RefusesWhatItCannotDoBeforeTheRun) {
  const std::string world = world_file("falling.sdf").string();
  const std::string file = (folder_ / "way.csv").string();
  const Outcome none =
      run_tessera({"run", world, "--trajectory", file, "--bodies", "falling::box_1,nobody*"});
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.output, HasSubstr("--bodies: \"nobody*\" matches none of the 11 bodies of the world"));
  EXPECT_FALSE(std::filesystem::exists(file));
  const Outcome never = run_tessera({"run", world, "--trajectory", file, "--every", "0"});
  EXPECT_EQ(never.code, 2);
  EXPECT_THAT(never.output, AllOf(HasSubstr("--every"), HasSubstr("1 to 1000000000")));
  const Outcome nowhere = run_tessera({"run", world, "--trajectory", "/no/such/folder/way.csv"});
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_THAT(nowhere.output, AllOf(HasSubstr("--trajectory"), HasSubstr("/no/such/folder/way.csv"),
                                    HasSubstr("No such file or directory")));
  EXPECT_THAT(run_tessera({"run", world, "--trajectory", file, "--bodies", "a,,b"}).output,
              HasSubstr("\"a,,b\" has an empty name"));
  for (const std::vector<std::string>& lone : {std::vector<std::string>{"--bodies", "*"}, {"--every", "2"}}) {
    const Outcome alone = run_tessera({"run", world, lone[0], lone[1]});
    EXPECT_EQ(alone.code, 2);
    EXPECT_THAT(alone.output, AllOf(HasSubstr(lone[0]), HasSubstr("--trajectory")));
  }
}

}  // namespace
}  // namespace tessera
