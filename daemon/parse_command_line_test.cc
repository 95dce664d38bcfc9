#include "daemon/parse_command_line.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/options.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// What is wrong with the arguments of a program with two commands, one of which has options.
std::string error_of(std::vector<std::string> arguments, std::string* printed = nullptr) {
  CLI::App app("", "program");
  app.require_subcommand(1);
  double seconds = 0;
  app.add_subcommand("run")->add_option("--seconds,-s", seconds)->check(number_within(0, 1e9));
  CLI::App& spawn = *app.add_subcommand("spawn");
  spawn.add_option("body")->required();
  spawn.add_option("--mass", seconds)->required();
  spawn.add_flag("--fixed");
  arguments.insert(arguments.begin(), "program");
  std::vector<char*> all;
  for (std::string& argument : arguments) all.push_back(argument.data());
  try {
    parse_command_line(app, static_cast<int>(all.size()), all.data());
  } catch (const CLI::ParseError& error) {
    std::ostringstream out;
    app.exit(error, out, out);
    if (printed != nullptr) *printed = out.str();
    return error.what();
  }
  return "";
}

TEST(ParseCommandLine, TellsWhatWasMeant) {
  EXPECT_EQ(error_of({"run", "--seconds", "3"}), "");
  EXPECT_EQ(error_of({"run", "--secnds", "3"}),
            "The following argument was not expected: --secnds (did you mean --seconds?)");
  EXPECT_EQ(error_of({"run", "--secnds=3"}),
            "The following argument was not expected: --secnds=3 (did you mean --seconds?)");
  EXPECT_EQ(error_of({"rum"}),
            "The following argument was not expected: rum (did you mean run?)\nThere are: run, spawn");
  EXPECT_EQ(error_of({"run", "one", "two", "three"}),
            "The following arguments were not expected: one two three");
}

TEST(ParseCommandLine, NumbersAreWithinTheirBounds) {
  EXPECT_EQ(error_of({"run", "--seconds", "1e9"}), "");
  EXPECT_EQ(error_of({"run", "--seconds", "nan"}), "--seconds: Value nan is not a number");
  for (const char* value : {"-1", "inf", "-inf", "one"}) {
    EXPECT_THAT(error_of({"run", "--seconds", value}),
                testing::StartsWith(absl::StrCat("--seconds: Value ", value, " not in range 0")));
  }
}

TEST(ParseCommandLine, GuessesNothingFarFetched) {
  EXPECT_EQ(error_of({"run", "--x"}), "The following argument was not expected: --x");
  EXPECT_EQ(error_of({"run", "--"}), "");
  EXPECT_EQ(error_of({"run", "-"}), "The following argument was not expected: -");
}

TEST(ParseCommandLine, TellsWhatIsUnknownBeforeWhatIsMissing) {
  EXPECT_EQ(error_of({"spawn", "--bdoy"}), "The following argument was not expected: --bdoy");
  EXPECT_EQ(error_of({"spawn"}), "body is required");
}

TEST(ParseCommandLine, PrintsWhatTheCommandTakes) {
  const auto printed = [](const std::vector<std::string>& arguments) {
    std::string text;
    error_of(arguments, &text);
    return text;
  };
  EXPECT_EQ(printed({"spawn", "box", "ball", "--mass", "1"}),
            "The following argument was not expected: ball\n"
            "Usage: program spawn --mass FLOAT [OPTIONS] body\n"
            "Options: --fixed\n"
            "Run program spawn --help for more information.\n");
  EXPECT_THAT(printed({"spawn", "--mass", "1"}),
              testing::HasSubstr("body is required\nUsage: program spawn --mass FLOAT [OPTIONS] body\n"));
  EXPECT_THAT(printed({"run", "--seconds"}),
              testing::HasSubstr("Usage: program run [OPTIONS]\nOptions: --seconds\n"));
  EXPECT_THAT(printed({}), testing::HasSubstr("Usage: program COMMAND\n"));
  EXPECT_EQ(printed({"run", "--seconds", "nan"}),
            "--seconds: Value nan is not a number\nRun program run --help for more information.\n");
}

TEST(Options, TakeLabelsBetweenCommas) {
  Labels labels;
  CLI::App app;
  add_labels(app, "--labels", labels, "Where it is");
  app.parse("--labels zone=eu,rack=a7");
  EXPECT_THAT(labels, ElementsAre("zone=eu", "rack=a7"));
  EXPECT_THROW(app.parse("--labels zone=eu,rack"), CLI::ValidationError);
  app.parse(std::vector<std::string>{"", "--labels"});
  EXPECT_THAT(labels, IsEmpty());
}

}  // namespace
}  // namespace tessera
